#include "host/perception/graph_cut.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

// The graph of OpenCV's grabCut; it takes its includes from whoever includes it.
#include <opencv2/core.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

namespace swarmfit::perception {

int PottsEnergy::add_node() {
  first_.push_back(choices_.size());
  return static_cast<int>(first_.size()) - 1;
}

void PottsEnergy::add_label(Label label, Cost cost) { choices_.push_back({label, cost}); }

void PottsEnergy::add_edge(int i, int j, Cost weight) {
  if (weight > 0 && i != j) edges_.push_back({i, j, weight});
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
  for (const Edge& e : edges_)
    if (labels[static_cast<std::size_t>(e.i)] != labels[static_cast<std::size_t>(e.j)]) sum += e.weight;
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
  takers_.clear();
  for (std::size_t i = 0; i < nodes(); ++i)
    for (const Choice& choice : choices(i)) takers_[choice.label].push_back({static_cast<int>(i), choice.cost});
  first_neighbour_.assign(nodes() + 1, 0);
  for (const Edge& e : edges_) {
    ++first_neighbour_[static_cast<std::size_t>(e.i) + 1];
    ++first_neighbour_[static_cast<std::size_t>(e.j) + 1];
  }
  std::partial_sum(first_neighbour_.begin(), first_neighbour_.end(), first_neighbour_.begin());
  neighbours_.resize(2 * edges_.size());
  std::vector<std::size_t> next(first_neighbour_.begin(), first_neighbour_.end() - 1);
  for (const Edge& e : edges_) {
    neighbours_[next[static_cast<std::size_t>(e.i)]++] = {e.j, e.weight};
    neighbours_[next[static_cast<std::size_t>(e.j)]++] = {e.i, e.weight};
  }
}

std::span<const PottsEnergy::Neighbour> PottsEnergy::neighbours(std::size_t node) const {
  return std::span(neighbours_).subspan(first_neighbour_[node], first_neighbour_[node + 1] - first_neighbour_[node]);
}

PottsEnergy::Cost PottsEnergy::expand(Label alpha, std::vector<Label>& labels) const {
  const auto takers = takers_.find(alpha);
  if (takers == takers_.end()) return 0;
  // Who may change: a vertex of the graph each. x = 0 (source side) keeps its label, x = 1 (sink side) takes alpha.
  std::vector<int> vertex(nodes(), -1);
  std::vector<std::size_t> node;
  std::vector<Cost> keep, take;
  std::size_t degrees = 0;
  for (const Taker& taker : takers->second) {
    const auto i = static_cast<std::size_t>(taker.node);
    if (labels[i] == alpha) continue;
    vertex[i] = static_cast<int>(node.size());
    node.push_back(i);
    keep.push_back(find(i, labels[i])->cost);
    take.push_back(taker.cost);
    degrees += neighbours(i).size();
  }
  if (node.empty()) return 0;
  Cost fall = 0;  // of the nodes' own costs; the edges' share follows

  cv::detail::GCGraph<Cost> graph(static_cast<unsigned>(node.size()), static_cast<unsigned>(degrees));
  for (std::size_t k = 0; k < node.size(); ++k) graph.addVtx();
  // Of several minimum cuts GCGraph may return a mixture that is none. A bias of one part in (vertices + 1) towards keeping leaves one cut
  // only, and it is among the least of the unbiased ones.
  const Cost scale = static_cast<Cost>(node.size()) + 1;
  const std::vector<Cost> own_keep = keep, own_take = take;
  bool connected = false;
  for (std::size_t a = 0; a < node.size(); ++a)
    for (const Neighbour& neighbour : neighbours(node[a])) {
      const auto j = static_cast<std::size_t>(neighbour.node);
      const Cost weight = neighbour.weight;
      if (vertex[j] < 0) {  // the other end stands fixed
        if (labels[node[a]] != labels[j]) keep[a] += weight;
        if (alpha != labels[j]) take[a] += weight;
        continue;
      }
      const auto b = static_cast<std::size_t>(vertex[j]);
      if (b < a) continue;  // seen from the other end
      // E(0,0) = w [l_i != l_j], E(0,1) = E(1,0) = w, E(1,1) = 0, written as terminals and one edge (Kolmogorov and Zabih 2004).
      const Cost both_keep = labels[node[a]] != labels[j] ? weight : 0;
      take[a] += weight - both_keep;
      keep[b] += weight;  // -w x_b, up to a constant
      graph.addEdges(static_cast<int>(a), static_cast<int>(b), scale * (2 * weight - both_keep), 0);
      connected = true;
    }
  for (std::size_t k = 0; k < node.size(); ++k) graph.addTermWeights(static_cast<int>(k), scale * take[k] + 1, scale * keep[k]);
  if (connected) graph.maxFlow();

  std::vector<bool> takes(node.size());
  for (std::size_t k = 0; k < node.size(); ++k) takes[k] = connected ? !graph.inSourceSegment(static_cast<int>(k)) : take[k] < keep[k];
  for (std::size_t k = 0; k < node.size(); ++k) {
    if (takes[k]) fall += own_keep[k] - own_take[k];
    for (const Neighbour& neighbour : neighbours(node[k])) {
      const auto j = static_cast<std::size_t>(neighbour.node);
      if (vertex[j] >= 0 && static_cast<std::size_t>(vertex[j]) < k) continue;
      const Label mine = takes[k] ? alpha : labels[node[k]];
      const Label other = vertex[j] >= 0 && takes[static_cast<std::size_t>(vertex[j])] ? alpha : labels[j];
      fall += neighbour.weight * (static_cast<int>(labels[node[k]] != labels[j]) - static_cast<int>(mine != other));
    }
  }
  if (fall <= 0) return 0;
  for (std::size_t k = 0; k < node.size(); ++k)
    if (takes[k]) labels[node[k]] = alpha;
  return fall;
}

PottsEnergy::Cost PottsEnergy::minimise(std::span<const Label> order, int cycles, std::vector<Label>& labels) const {
  std::size_t still = 0;  // expansions in a row that found nothing; after all of `order`, none can
  for (int cycle = 0; cycle < cycles && still < order.size(); ++cycle)
    for (const Label alpha : order) {
      still = expand(alpha, labels) > 0 ? 1 : still + 1;
      if (still >= order.size()) break;
    }
  return energy(labels);
}

}  // namespace swarmfit::perception
