#include "host/common/min_cut.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace swarmfit::common {

/// Two trees, of nodes that the source still reaches and of nodes that still reach the sink, grow until they meet; the path is filled up;
/// nodes cut off by that look for new parents.
class CutSearch {
 public:
  explicit CutSearch(CutGraph& graph) : graph_(graph) {}
  void run(std::span<const std::int32_t> part);

 private:
  static constexpr std::int32_t kFree = CutGraph::kFree, kTerminal = CutGraph::kTerminal, kOrphan = CutGraph::kOrphan;
  static constexpr std::int32_t kNone = -1, kFar = std::numeric_limits<std::int32_t>::max();

  CutGraph::Node& node(std::int32_t i) { return graph_.nodes_[static_cast<std::size_t>(i)]; }
  std::int32_t head(std::int32_t a) const { return graph_.arc(a).head; }
  std::int32_t mate(std::int32_t a) const { return graph_.arc(a).mate; }
  std::int32_t& left(std::int32_t a) { return graph_.capacity(a); }
  /// What can still flow along `a` towards the sink, if `a` leads away from a node of that tree.
  bool open(std::int32_t a, bool sink) { return left(sink ? mate(a) : a) > 0; }

  void activate(std::int32_t i) {
    if (node(i).next != kNone) return;
    (last_ == kNone ? first_ : node(last_).next) = i;
    last_ = i;
    node(i).next = i;
  }
  std::int32_t next_active();
  std::int32_t grow(std::int32_t i);
  void augment(std::int32_t middle);
  std::int32_t narrowest(std::int32_t i, std::int32_t limit, bool sink);
  void push(std::int32_t i, std::int32_t flow, bool sink);
  void adopt(std::int32_t i);
  std::int32_t distance_to_terminal(std::int32_t i);

  CutGraph& graph_;
  std::vector<std::int32_t> orphans_;
  std::int32_t first_ = kNone, last_ = kNone;  // active nodes
  std::int32_t time_ = 0;
};

std::int32_t CutSearch::next_active() {
  while (first_ != kNone) {
    const std::int32_t i = first_;
    first_ = node(i).next == i ? kNone : node(i).next;
    if (first_ == kNone) last_ = kNone;
    node(i).next = kNone;
    if (node(i).parent != kFree) return i;
  }
  return kNone;
}

/// Adds free neighbours of `i` to its tree. Returns an arc from the source's tree to the sink's where they meet, else kNone.
std::int32_t CutSearch::grow(std::int32_t i) {
  const CutGraph::Node own = node(i);
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    if (!open(a, own.sink)) continue;
    const std::int32_t j = head(a);
    CutGraph::Node& other = node(j);
    if (other.parent == kFree) {
      other.sink = own.sink;
      other.parent = mate(a);
      other.stamp = own.stamp;
      other.distance = own.distance + 1;
      activate(j);
    } else if (other.sink != own.sink) {
      return own.sink ? mate(a) : a;
    } else if (other.stamp <= own.stamp && other.distance > own.distance + 1) {
      other.parent = mate(a);  // a shorter way to the terminal
      other.stamp = own.stamp;
      other.distance = own.distance + 1;
    }
  }
  return kNone;
}

/// The least of `limit` and what is left on the way from `i` to its terminal.
std::int32_t CutSearch::narrowest(std::int32_t i, std::int32_t limit, bool sink) {
  for (std::int32_t a = node(i).parent; a != kTerminal; i = head(a), a = node(i).parent) limit = std::min(limit, left(sink ? a : mate(a)));
  return std::min(limit, std::abs(node(i).terminal));
}

void CutSearch::push(std::int32_t i, std::int32_t flow, bool sink) {
  const auto cut_off = [&](std::int32_t k) {
    node(k).parent = kOrphan;
    orphans_.push_back(k);
  };
  std::int32_t a = node(i).parent;
  while (a != kTerminal) {
    const std::int32_t along = sink ? a : mate(a), to = head(a);
    left(along) -= flow;
    left(mate(along)) += flow;
    if (left(along) == 0) cut_off(i);
    i = to;
    a = node(i).parent;
  }
  node(i).terminal -= sink ? -flow : flow;
  if (node(i).terminal == 0) cut_off(i);
}

void CutSearch::augment(std::int32_t middle) {
  const std::int32_t from = head(mate(middle)), to = head(middle);
  const std::int32_t flow = narrowest(to, narrowest(from, left(middle), false), true);
  left(middle) -= flow;
  left(mate(middle)) += flow;
  push(from, flow, false);
  push(to, flow, true);
}

/// kFar where the way ends at an orphan. Marks the way, so that it is not walked again in this round.
std::int32_t CutSearch::distance_to_terminal(std::int32_t i) {
  std::int32_t distance = 0;
  for (std::int32_t k = i;;) {
    CutGraph::Node& n = node(k);
    if (n.stamp == time_) {
      distance += n.distance;
      break;
    }
    ++distance;
    if (n.parent == kTerminal) {
      n.stamp = time_;
      n.distance = 1;
      break;
    }
    if (n.parent == kOrphan) return kFar;
    k = head(n.parent);
  }
  std::int32_t rest = distance;
  for (std::int32_t k = i; node(k).stamp != time_; k = head(node(k).parent)) {
    node(k).stamp = time_;
    node(k).distance = rest--;
  }
  return distance;
}

/// A new parent for an orphan; without one it is free, and its children are orphans.
void CutSearch::adopt(std::int32_t i) {
  const bool sink = node(i).sink;
  std::int32_t best = kFree, nearest = kFar;
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    if (!open(mate(a), sink)) continue;
    const CutGraph::Node& other = node(head(a));
    if (other.sink != sink || other.parent == kFree) continue;
    const std::int32_t distance = distance_to_terminal(head(a));
    if (distance >= nearest) continue;
    nearest = distance;
    best = a;
  }
  node(i).parent = best;
  if (best != kFree) {
    node(i).stamp = time_;
    node(i).distance = nearest + 1;
    return;
  }
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    if (left(a) == 0 && left(mate(a)) == 0) continue;  // may lead out of the part
    const std::int32_t j = head(a);
    CutGraph::Node& other = node(j);
    if (other.sink != sink || other.parent == kFree) continue;
    if (open(mate(a), sink)) activate(j);
    if (other.parent >= 0 && head(other.parent) == i) {
      other.parent = kOrphan;
      orphans_.push_back(j);
    }
  }
}

void CutSearch::run(std::span<const std::int32_t> part) {
  for (const std::int32_t i : part) {
    CutGraph::Node& n = node(i);
    n.next = kNone;
    n.stamp = 0;
    n.distance = 1;
    n.sink = n.terminal < 0;
    n.parent = n.terminal == 0 ? kFree : kTerminal;
    if (n.terminal != 0) activate(i);
  }
  for (std::int32_t i = next_active(); i != kNone;) {
    const std::int32_t middle = grow(i);
    ++time_;
    if (middle == kNone) {
      i = next_active();
      continue;
    }
    augment(middle);
    // In turn, as they were cut off; more may come on the way.
    for (std::size_t k = 0; k < orphans_.size(); ++k) adopt(orphans_[k]);
    orphans_.clear();
    if (node(i).parent == kFree) i = next_active();
  }
}

CutGraph::CutGraph(std::vector<std::int32_t> first, std::vector<Arc> arcs)
    : first_(std::move(first)), arcs_(std::move(arcs)), capacity_(arcs_.size()), nodes_(first_.empty() ? 0 : first_.size() - 1) {}

void CutGraph::cut(std::span<const std::int32_t> part) { CutSearch(*this).run(part); }

}  // namespace swarmfit::common
