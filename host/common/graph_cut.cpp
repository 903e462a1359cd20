#include "host/common/graph_cut.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <numeric>
#include <utility>

#include "host/common/parallel.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::common {

void PottsEnergy::reserve(std::size_t nodes, std::size_t labels, std::size_t edges) {
  first_.reserve(nodes);
  choices_.reserve(labels);
  edges_.reserve(edges);
}

int PottsEnergy::add_node() {
  first_.push_back(choices_.size());
  return static_cast<int>(first_.size()) - 1;
}

void PottsEnergy::add_label(Label label, Cost cost) { choices_.push_back({label, static_cast<std::int32_t>(cost)}); }

void PottsEnergy::add_edge(int i, int j, Cost weight) {
  if (weight > 0 && i != j) edges_.push_back({i, j, static_cast<std::int32_t>(weight)});
}

std::span<const PottsEnergy::Choice> PottsEnergy::choices(std::size_t node) const {
  const std::size_t end = node + 1 < first_.size() ? first_[node + 1] : choices_.size();
  return std::span(choices_).subspan(first_[node], end - first_[node]);
}

const PottsEnergy::Choice* PottsEnergy::find(std::size_t node, Label label) const {
  for (const Choice& choice : choices(node))
    if (choice.label == label) return &choice;
  return nullptr;
}

PottsEnergy::Cost PottsEnergy::energy(std::span<const Label> labels) const {
  Cost sum = 0;
  for (std::size_t i = 0; i < nodes(); ++i) sum += find(i, labels[i])->cost;
  for (const Edge& e : edges_) sum += apart(e.weight, labels[static_cast<std::size_t>(e.i)], labels[static_cast<std::size_t>(e.j)]);
  return sum;
}

std::vector<PottsEnergy::Label> PottsEnergy::cheapest() const {
  std::vector<Label> labels(nodes());
  for (std::size_t i = 0; i < nodes(); ++i) {
    const auto all = choices(i);
    labels[i] = std::min_element(all.begin(), all.end(), [](const Choice& a, const Choice& b) { return a.cost < b.cost; })->label;
  }
  return labels;
}

void PottsEnergy::close() {
  role_.assign(nodes(), Role::fixed);
  borders_.resize(nodes());
  take_.resize(nodes());
  if (pieces_.empty()) {
    make_graph();
    find_pieces();
  }
  takers_.clear();
  takers_.reserve(choices_.size());
  piece_takers_.clear();
  for (Piece& piece : pieces_) find_takers(piece);
}

void PottsEnergy::forget_labels() {
  first_.clear();
  choices_.clear();
}

void PottsEnergy::make_graph() {
  kernels::Reused<std::int32_t> first(nodes() + 1, 0);
  for (const Edge& e : edges_) {
    ++first[static_cast<std::size_t>(e.i) + 1];
    ++first[static_cast<std::size_t>(e.j) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  kernels::Reused<std::int32_t> next(first.begin(), first.end() - 1);
  kernels::Reused<CutGraph::Arc> arcs(2 * edges_.size());
  weight_.resize(arcs.size());
  for (const Edge& e : edges_) {
    const std::int32_t there = next[static_cast<std::size_t>(e.i)]++, back = next[static_cast<std::size_t>(e.j)]++;
    arcs[static_cast<std::size_t>(there)] = {e.j, back};
    arcs[static_cast<std::size_t>(back)] = {e.i, there};
    weight_[static_cast<std::size_t>(there)] = weight_[static_cast<std::size_t>(back)] = e.weight;
  }
  graph_ = CutGraph(std::move(first), std::move(arcs));
}

void PottsEnergy::find_pieces() {
  kernels::Reused<std::uint8_t> met(nodes(), 0);
  piece_nodes_.reserve(nodes());
  for (std::size_t seed = 0; seed < nodes(); ++seed) {
    if (met[seed] != 0) continue;
    Piece& piece = pieces_.emplace_back();
    piece.first_node = piece_nodes_.size();
    piece_nodes_.push_back(static_cast<std::int32_t>(seed));
    met[seed] = 1;
    for (std::size_t k = piece.first_node; k < piece_nodes_.size(); ++k)
      for (std::int32_t a = graph_.first_arc(piece_nodes_[k]); a < graph_.last_arc(piece_nodes_[k]); ++a) {
        const std::int32_t j = graph_.arc(a).head;
        if (met[static_cast<std::size_t>(j)] != 0) continue;
        met[static_cast<std::size_t>(j)] = 1;
        piece_nodes_.push_back(j);
      }
    piece.last_node = piece_nodes_.size();
  }
  // The longest work first, so that threads end together.
  std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) {
    const std::size_t one = a.last_node - a.first_node, other = b.last_node - b.first_node;
    return one != other ? one > other : a.first_node < b.first_node;
  });
}

void PottsEnergy::find_takers(Piece& piece) {
  piece.first_takers = piece_takers_.size();
  // Counted first, then laid out label by label.
  for (const std::int32_t i : nodes_of(piece))
    for (const Choice& choice : choices(static_cast<std::size_t>(i))) {
      if (choice.label >= place_.size()) place_.resize(choice.label + std::size_t{1}, kNowhere);
      std::size_t& place = place_[choice.label];
      if (place == kNowhere) {
        place = piece_takers_.size();
        piece_takers_.push_back({choice.label, 0, 0, true});
      }
      ++piece_takers_[place].last;
    }
  piece.last_takers = piece_takers_.size();
  std::size_t first = takers_.size();
  for (Takers& t : takers_of(piece)) {
    const std::size_t count = t.last;
    t.first = t.last = first;
    first += count;
  }
  takers_.resize(first);
  for (const std::int32_t i : nodes_of(piece))
    for (const Choice& choice : choices(static_cast<std::size_t>(i)))
      takers_[piece_takers_[place_[choice.label]].last++] = {i, choice.cost};
  for (const Takers& t : takers_of(piece)) place_[t.label] = kNowhere;
}

/// x = 0 (source side) keeps its label, x = 1 (sink side) takes alpha. What a pair (i, j), i < j, costs at (x_i, x_j) is split into a part
/// of x_i alone, V(1,0) - V(0,0), a part of x_j alone, -V(1,0), and the rest V(0,1) + V(1,0) - V(0,0) at (0, 1) (Kolmogorov and Zabih
/// 2004). Two of the same label ask for the same at (0, 1) and at (1, 0), and for nothing alone.
void PottsEnergy::set_capacities(std::int32_t i, Label alpha, std::int32_t take, std::span<const Label> labels) {
  const Label own = labels[static_cast<std::size_t>(i)];
  std::int32_t gain = take - find(static_cast<std::size_t>(i), own)->cost;  // of keeping over taking
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    const auto [head, mate] = graph_.arc(a);
    const auto j = static_cast<std::size_t>(head);
    const std::int32_t weight = weight_[static_cast<std::size_t>(a)], i_takes = apart(weight, alpha, labels[j]);
    if (role_[j] == Role::fixed) {
      gain += i_takes - apart(weight, own, labels[j]);
      graph_.capacity(a) = graph_.capacity(mate) = 0;
    } else if (own == labels[j]) {
      graph_.capacity(a) = i_takes;
    } else {
      const std::int32_t kept = apart(weight, own, labels[j]), j_takes = apart(weight, own, alpha);
      gain += i < head ? i_takes - kept : -j_takes;
      graph_.capacity(a) = i < head ? i_takes + j_takes - kept : 0;
    }
  }
  graph_.terminal(i) = gain;
}

PottsEnergy::Cost PottsEnergy::fall_of(std::span<const std::int32_t> part, Label alpha, std::span<const Label> labels) const {
  Cost fall = 0;
  for (const std::int32_t i : part) {
    if (role_[static_cast<std::size_t>(i)] != Role::takes) continue;
    const Label own = labels[static_cast<std::size_t>(i)];
    fall += find(static_cast<std::size_t>(i), own)->cost - take_[static_cast<std::size_t>(i)];
    for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
      const std::int32_t j = graph_.arc(a).head;
      const Label other = labels[static_cast<std::size_t>(j)];
      const bool both = role_[static_cast<std::size_t>(j)] == Role::takes;
      if (both && j < i) continue;  // seen from the other end
      const std::int32_t weight = weight_[static_cast<std::size_t>(a)];
      fall += apart(weight, own, other) - (both ? 0 : apart(weight, alpha, other));
    }
  }
  return fall;
}

/// A node that took alpha is news to every other label that it or a neighbour may take.
void PottsEnergy::make_stale(const Piece& piece, std::size_t node, Label alpha) {
  const auto mark = [&](std::size_t i) {
    for (const Choice& choice : choices(i))
      for (Takers& t : takers_of(piece)) t.stale = t.stale || (t.label == choice.label && t.label != alpha);
  };
  mark(node);
  for (auto a = graph_.first_arc(static_cast<std::int32_t>(node)); a < graph_.last_arc(static_cast<std::int32_t>(node)); ++a)
    mark(static_cast<std::size_t>(graph_.arc(a).head));
}

void PottsEnergy::count_borders(const Piece& piece, std::span<const Label> labels) {
  for (const std::int32_t i : nodes_of(piece)) {
    std::int32_t& count = borders_[static_cast<std::size_t>(i)] = 0;
    for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a)
      count += labels[static_cast<std::size_t>(graph_.arc(a).head)] != labels[static_cast<std::size_t>(i)] ? 1 : 0;
  }
}

void PottsEnergy::relabel(std::int32_t i, Label alpha, std::vector<Label>& labels) {
  const Label before = std::exchange(labels[static_cast<std::size_t>(i)], alpha);
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    const auto j = static_cast<std::size_t>(graph_.arc(a).head);
    const std::int32_t more = (labels[j] != alpha ? 1 : 0) - (labels[j] != before ? 1 : 0);
    borders_[j] += more;
    borders_[static_cast<std::size_t>(i)] += more;
  }
}

PottsEnergy::Cost PottsEnergy::expand(const Piece& piece, const Takers& takers, std::vector<Label>& labels) {
  const Label alpha = takers.label;
  kernels::Reused<std::int32_t> part;
  part.reserve(takers.last - takers.first);
  for (std::size_t t = takers.first; t < takers.last; ++t) {
    const auto i = static_cast<std::size_t>(takers_[t].node);
    if (labels[i] == alpha) continue;
    role_[i] = Role::may_take;
    take_[i] = takers_[t].cost;
    part.push_back(takers_[t].node);
  }
  const auto prepare = [&](std::int32_t i) { set_capacities(i, alpha, take_[static_cast<std::size_t>(i)], labels); };
  for (const std::int32_t node : part) {
    // Among its like a node only loses by taking what is dearer.
    const auto i = static_cast<std::size_t>(node);
    if (borders_[i] == 0 && take_[i] >= find(i, labels[i])->cost) {
      graph_.put_off(node);
    } else {
      prepare(node);
    }
  }
  graph_.cut(part, std::cref(prepare));  // a reference fits where a function is kept
  for (const std::int32_t i : part)
    if (graph_.at_sink(i)) role_[static_cast<std::size_t>(i)] = Role::takes;
  const Cost fall = fall_of(part, alpha, labels);
  for (const std::int32_t node : part) {
    const auto i = static_cast<std::size_t>(node);
    if (role_[i] == Role::takes && fall > 0) {
      relabel(node, alpha, labels);
      make_stale(piece, i, alpha);
    }
    role_[i] = Role::fixed;
  }
  return fall;
}

PottsEnergy::Cost PottsEnergy::expand(Label alpha, std::vector<Label>& labels) {
  Cost fall = 0;
  for (const Piece& piece : pieces_) {
    count_borders(piece, labels);
    for (const Takers& takers : takers_of(piece))
      if (takers.label == alpha) fall += expand(piece, takers, labels);
  }
  return fall;
}

PottsEnergy::Cost PottsEnergy::minimise(std::span<const Label> order, int cycles, std::vector<Label>& labels, int threads) {
  std::atomic<Cost> fall = 0;  // whole numbers: the sum is the same in any order
  const auto some = [&](int first, int last) {
    for (int k = first; k < last; ++k) {
      const Piece& piece = pieces_[static_cast<std::size_t>(k)];
      for (Takers& takers : takers_of(piece)) takers.stale = true;
      count_borders(piece, labels);
      bool still = false;
      for (int cycle = 0; cycle < cycles && !still; ++cycle) {
        still = true;
        for (const Label alpha : order)
          for (Takers& takers : takers_of(piece)) {
            if (takers.label != alpha || !takers.stale) continue;
            takers.stale = false;
            const Cost fell = expand(piece, takers, labels);
            fall += fell;
            still = still && fell == 0;
          }
      }
    }
  };
  in_parallel(static_cast<int>(pieces_.size()), 1, threads, std::cref(some));  // a reference fits where a function is kept
  return fall;
}

}  // namespace swarmfit::common
