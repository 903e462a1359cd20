// Minimum cuts of a graph between a source and a sink, after Boykov and Kolmogorov 2004.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "kernels/reused.hpp"

namespace swarmfit::common {

/// One graph, of which each cut takes a part. Arcs lie node by node, and each has its mate in the other direction. Parts without a node or
/// an arc in common may be cut at the same time by different threads.
class CutGraph {
 public:
  struct Arc {
    std::int32_t head, mate;  ///< node at its other end, and the arc back
  };

  CutGraph() = default;
  /// Arcs of node i are [first[i], first[i + 1]).
  CutGraph(kernels::Reused<std::int32_t> first, kernels::Reused<Arc> arcs);

  std::int32_t first_arc(std::int32_t node) const noexcept { return first_[static_cast<std::size_t>(node)]; }
  std::int32_t last_arc(std::int32_t node) const noexcept { return first_[static_cast<std::size_t>(node) + 1]; }
  const Arc& arc(std::int32_t a) const noexcept { return arcs_[static_cast<std::size_t>(a)]; }

  // To be set before each cut, for all its nodes and all arcs at them, or on the way; below 2^30.
  /// An arc that leaves the part has none, and neither has its mate.
  std::int32_t& capacity(std::int32_t a) noexcept { return capacity_[static_cast<std::size_t>(a)]; }
  /// From the source where > 0, to the sink where < 0.
  std::int32_t& terminal(std::int32_t node) noexcept { return nodes_[static_cast<std::size_t>(node)].terminal; }

  /// The terminal of a node and the capacities at it are not set for the next cut: prepare(node) will, if they are asked for. The terminal
  /// is not the sink's.
  void put_off(std::int32_t node) noexcept { nodes_[static_cast<std::size_t>(node)].put_off = true; }

  using Prepare = std::function<void(std::int32_t)>;
  /// Finds a minimum cut between the nodes of `part`, the one with the fewest nodes on the sink's side.
  void cut(std::span<const std::int32_t> part, const Prepare& prepare = {});
  bool at_sink(std::int32_t node) const noexcept { return nodes_[static_cast<std::size_t>(node)].parent != kFree; }

 private:
  friend class CutSearch;
  static constexpr std::int32_t kFree = -1, kTerminal = -2, kOrphan = -3;  // instead of a parent's arc
  struct Node {
    std::int32_t terminal = 0;
    std::int32_t parent = kFree;  // the arc towards it
    std::int32_t next = -1;       // in the list of active nodes; itself where it is the last
    std::int32_t stamp = 0;       // when `distance` was true
    std::int32_t distance = 0;    // to the sink, in arcs
    bool put_off = false;
  };

  kernels::Reused<std::int32_t> first_;
  kernels::Reused<Arc> arcs_;
  kernels::Reused<std::int32_t> capacity_;
  kernels::Reused<Node> nodes_;
};

}  // namespace swarmfit::common
