#include "host/perception/graph_cut.hpp"

#include <algorithm>
#include <cmath>

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

PottsEnergy::Cost PottsEnergy::expand(Label alpha, std::vector<Label>& labels) const {
  // Who may change: a vertex of the graph each. x = 0 (source side) keeps its label, x = 1 (sink side) takes alpha.
  std::vector<int> vertex(nodes(), -1), node;
  std::vector<Cost> keep, take;
  for (std::size_t i = 0; i < nodes(); ++i) {
    if (labels[i] == alpha) continue;
    const Choice* choice = find(i, alpha);
    if (choice == nullptr) continue;
    vertex[i] = static_cast<int>(node.size());
    node.push_back(static_cast<int>(i));
    keep.push_back(find(i, labels[i])->cost);
    take.push_back(choice->cost);
  }
  if (node.empty()) return 0;
  const std::vector<Cost> cost_of_label = keep, cost_of_alpha = take;

  cv::detail::GCGraph<Cost> graph(static_cast<unsigned>(node.size()), static_cast<unsigned>(2 * edges_.size()));
  for (std::size_t k = 0; k < node.size(); ++k) graph.addVtx();
  // Of several minimum cuts GCGraph may return a mixture that is none. A bias of one part in (vertices + 1) towards keeping leaves one cut
  // only, and it is among the least of the unbiased ones.
  const Cost scale = static_cast<Cost>(node.size()) + 1;
  bool connected = false;
  for (const Edge& e : edges_) {
    const auto i = static_cast<std::size_t>(e.i), j = static_cast<std::size_t>(e.j);
    const int a = vertex[i], b = vertex[j];
    if (a < 0 && b < 0) continue;
    if (a < 0 || b < 0) {  // the other end stands fixed
      const auto free = static_cast<std::size_t>(a < 0 ? b : a);
      const Label fixed = labels[a < 0 ? i : j];
      if (labels[static_cast<std::size_t>(node[free])] != fixed) keep[free] += e.weight;
      if (alpha != fixed) take[free] += e.weight;
      continue;
    }
    // E(0,0) = w [l_i != l_j], E(0,1) = E(1,0) = w, E(1,1) = 0, written as terminals and one edge (Kolmogorov and Zabih 2004).
    const Cost both_keep = labels[i] != labels[j] ? e.weight : 0;
    take[static_cast<std::size_t>(a)] += e.weight - both_keep;
    keep[static_cast<std::size_t>(b)] += e.weight;  // -w x_b, up to a constant
    graph.addEdges(a, b, scale * (2 * e.weight - both_keep), 0);
    connected = true;
  }
  std::vector<Label> moved = labels;
  for (std::size_t k = 0; k < node.size(); ++k) graph.addTermWeights(static_cast<int>(k), scale * take[k] + 1, scale * keep[k]);
  if (connected) graph.maxFlow();
  for (std::size_t k = 0; k < node.size(); ++k) {
    const bool takes = connected ? !graph.inSourceSegment(static_cast<int>(k)) : take[k] < keep[k];
    if (takes) moved[static_cast<std::size_t>(node[k])] = alpha;
  }
  Cost fall = 0;
  for (std::size_t k = 0; k < node.size(); ++k) {
    const auto i = static_cast<std::size_t>(node[k]);
    if (moved[i] == alpha) fall += cost_of_label[k] - cost_of_alpha[k];
  }
  for (const Edge& e : edges_) {
    const auto i = static_cast<std::size_t>(e.i), j = static_cast<std::size_t>(e.j);
    if (labels[i] != labels[j]) fall += e.weight;
    if (moved[i] != moved[j]) fall -= e.weight;
  }
  if (fall <= 0) return 0;
  labels = std::move(moved);
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
