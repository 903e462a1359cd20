// Potts energies over a sparse graph, lowered by alpha-expansion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace swarmfit::perception {

/// E(l) = sum_i cost_i(l_i) + sum_(i,j) w_ij [l_i != l_j]. Each node has its own list of labels it may take. Costs and weights are whole
/// numbers, so that energies are exact; keep them below 2^24.
class PottsEnergy {
 public:
  using Label = std::uint16_t;
  using Cost = std::int64_t;

  /// A new node; its labels follow by add_label before the next node.
  int add_node();
  /// The last node may take `label`, once each.
  void add_label(Label label, Cost cost);
  /// weight >= 0; a weight of 0 is no edge.
  void add_edge(int i, int j, Cost weight);

  /// Call once after the last add, before any expansion.
  void close();

  std::size_t nodes() const noexcept { return first_.size(); }
  std::size_t edges() const noexcept { return edges_.size(); }

  /// Each label must be allowed where it stands.
  Cost energy(std::span<const Label> labels) const;
  /// Every node at its cheapest label, the edges ignored; the first listed where two cost the same.
  std::vector<Label> cheapest() const;

  /// The best labelling in which every node keeps its label or takes `alpha` (one minimum cut). Returns by how much the energy fell, >= 0;
  /// labels change only if it did.
  Cost expand(Label alpha, std::vector<Label>& labels) const;
  /// Expands each of `order` in turn, `cycles` times at most, until nothing changes. Returns the energy.
  Cost minimise(std::span<const Label> order, int cycles, std::vector<Label>& labels) const;

 private:
  struct Choice {
    Label label;
    Cost cost;
  };
  struct Edge {
    int i, j;
    Cost weight;
  };
  struct Neighbour {
    int node;
    Cost weight;
  };
  struct Taker {
    int node;
    Cost cost;
  };

  std::span<const Choice> choices(std::size_t node) const;
  std::span<const Neighbour> neighbours(std::size_t node) const;
  const Choice* find(std::size_t node, Label label) const;

  std::vector<std::size_t> first_;  // of each node's choices
  std::vector<Choice> choices_;
  std::vector<Edge> edges_;
  // Made by close(): who may take a label, and each node's neighbours, so that an expansion touches only those it concerns.
  std::map<Label, std::vector<Taker>> takers_;
  std::vector<std::size_t> first_neighbour_;
  std::vector<Neighbour> neighbours_;
};

}  // namespace swarmfit::perception
