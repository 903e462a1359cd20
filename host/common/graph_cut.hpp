// Potts energies over a sparse graph, lowered by alpha-expansion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/common/min_cut.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::common {

/// E(l) = sum_i cost_i(l_i) + sum_(i,j) w_ij [l_i != l_j]. Each node has its own list of labels it may take. Costs and weights are whole
/// numbers, so that energies are exact; a node's dearest label and all weights at it together must stay below 2^28. One label may be ground
/// that everything else stands on: next to it a pair costs half, which leaves alpha-expansion exact (half and half again is the whole).
class PottsEnergy {
 public:
  using Label = std::uint16_t;
  using Cost = std::int64_t;

  /// For so many nodes, labels over all nodes, and edges.
  void reserve(std::size_t nodes, std::size_t labels, std::size_t edges);
  /// A new node; its labels follow by add_label before the next node.
  int add_node();
  /// The last node may take `label`, once each.
  void add_label(Label label, Cost cost);
  /// weight >= 0; a weight of 0 is no edge.
  void add_edge(int i, int j, Cost weight);

  /// Makes a label the ground. All weights must be even then.
  void set_ground(Label label) noexcept { ground_ = label; }

  /// Call after the last add, before any expansion.
  void close();
  /// Nodes and their labels go, edges stay: as many nodes may be added again, and then it must be closed again.
  void forget_labels();

  std::size_t nodes() const noexcept { return first_.size(); }
  std::size_t edges() const noexcept { return edges_.size(); }

  /// Each label must be allowed where it stands.
  Cost energy(std::span<const Label> labels) const;
  /// Every node at its cheapest label, the edges ignored; the first listed where two cost the same.
  std::vector<Label> cheapest() const;

  /// The best labelling in which every node keeps its label or takes `alpha` (one minimum cut). Returns by how much the energy fell, >= 0;
  /// labels change only if it did.
  Cost expand(Label alpha, std::vector<Label>& labels);
  /// Expands each of `order` in turn, `cycles` times at most, until nothing changes. Returns by how much the energy fell. Pieces of the
  /// graph that no edge connects are worked on side by side, by at most `threads` threads (0: as many as there are).
  Cost minimise(std::span<const Label> order, int cycles, std::vector<Label>& labels, int threads = 0);

 private:
  struct Choice {
    Label label;
    std::int32_t cost;
  };
  struct Edge {
    std::int32_t i, j, weight;
  };
  struct Taker {
    std::int32_t node, cost;
  };
  /// Who may take a label within one piece of the graph.
  struct Takers {
    Label label;
    std::size_t first, last;
    bool stale;  ///< something has changed since the label was last expanded
  };
  /// Nodes that edges connect, and who of them may take what: ranges of `piece_nodes_` and `piece_takers_`.
  struct Piece {
    std::size_t first_node = 0, last_node = 0, first_takers = 0, last_takers = 0;
  };
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  enum class Role : std::uint8_t { fixed, may_take, takes };

  /// What a pair of labels costs at an edge of some weight.
  std::int32_t apart(std::int32_t weight, Label a, Label b) const noexcept {
    if (a == b) return 0;
    return a == ground_ || b == ground_ ? weight / 2 : weight;
  }
  std::span<const std::int32_t> nodes_of(const Piece& piece) const noexcept {
    return std::span(piece_nodes_).subspan(piece.first_node, piece.last_node - piece.first_node);
  }
  std::span<Takers> takers_of(const Piece& piece) noexcept {
    return std::span(piece_takers_).subspan(piece.first_takers, piece.last_takers - piece.first_takers);
  }
  std::span<const Choice> choices(std::size_t node) const;
  const Choice* find(std::size_t node, Label label) const;
  void make_graph();
  void find_pieces();
  void find_takers(Piece& piece);
  Cost expand(const Piece& piece, const Takers& takers, std::vector<Label>& labels);
  /// Of a node that may take alpha at a cost of `take`.
  void set_capacities(std::int32_t node, Label alpha, std::int32_t take, std::span<const Label> labels);
  Cost fall_of(std::span<const std::int32_t> part, Label alpha, std::span<const Label> labels) const;
  void make_stale(const Piece& piece, std::size_t node, Label alpha);
  void count_borders(const Piece& piece, std::span<const Label> labels);
  void relabel(std::int32_t node, Label alpha, std::vector<Label>& labels);

  kernels::Reused<std::size_t> first_;  // of each node's choices
  kernels::Reused<Choice> choices_;
  kernels::Reused<Edge> edges_;
  std::int32_t ground_ = -1;  // none
  // Made by close().
  CutGraph graph_;
  kernels::Reused<std::int32_t> weight_;  // one an arc
  kernels::Reused<Piece> pieces_;         // those with most nodes first
  kernels::Reused<std::int32_t> piece_nodes_;
  kernels::Reused<Takers> piece_takers_;
  kernels::Reused<Taker> takers_;
  kernels::Reused<std::size_t> place_;     // of a label among a piece's takers, while these are found
  kernels::Reused<Role> role_;             // one a node, within an expansion
  kernels::Reused<std::int32_t> borders_;  // of each node, how many of its neighbours have another label, while labels change
  kernels::Reused<std::int32_t> take_;     // of each node, what it costs to take the label of an expansion
};

}  // namespace swarmfit::common
