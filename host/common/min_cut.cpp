#include "host/common/min_cut.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "kernels/reused.hpp"

namespace swarmfit::common {

/// Boykov and Kolmogorov's search with one tree instead of two: of the nodes that still reach the sink. It grows until it meets a node that
/// the source still reaches; the way from there is filled up; nodes cut off by that look for new parents. What nobody asks to be on the
/// sink's side is never looked at.
class CutSearch {
 public:
  CutSearch(CutGraph& graph, const CutGraph::Prepare& prepare) : graph_(graph), prepare_(prepare) {}
  void run(std::span<const std::int32_t> part);

 private:
  static constexpr std::int32_t kFree = CutGraph::kFree, kTerminal = CutGraph::kTerminal, kOrphan = CutGraph::kOrphan;
  static constexpr std::int32_t kNone = -1, kFar = std::numeric_limits<std::int32_t>::max();

  CutGraph::Node& node(std::int32_t i) { return graph_.nodes_[static_cast<std::size_t>(i)]; }
  std::int32_t head(std::int32_t a) const { return graph_.arc(a).head; }
  std::int32_t mate(std::int32_t a) const { return graph_.arc(a).mate; }
  std::int32_t& left(std::int32_t a) { return graph_.capacity(a); }

  void activate(std::int32_t i) {
    if (node(i).next != kNone) return;
    (last_ == kNone ? first_ : node(last_).next) = i;
    last_ = i;
    node(i).next = i;
  }
  std::int32_t next_active();
  void grow(std::int32_t i);
  void augment(std::int32_t from, std::int32_t arc);
  void adopt(std::int32_t i);
  std::int32_t distance_to_sink(std::int32_t i);

  CutGraph& graph_;
  const CutGraph::Prepare& prepare_;
  kernels::Reused<std::int32_t> orphans_;
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

/// Adds the neighbours of `i` from which something can flow to it, those that the source reaches once nothing comes from there any more.
void CutSearch::grow(std::int32_t i) {
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    const std::int32_t back = mate(a), j = head(a);
    if (std::exchange(node(j).put_off, false)) prepare_(j);
    while (left(back) > 0) {
      CutGraph::Node& other = node(j);
      const CutGraph::Node& own = node(i);
      if (other.parent == kFree && other.terminal > 0) {
        augment(j, back);
        // In turn, as they were cut off; more may come on the way.
        ++time_;
        for (std::size_t k = 0; k < orphans_.size(); ++k) adopt(orphans_[k]);
        orphans_.clear();
        if (own.parent == kFree) return;
        continue;
      }
      if (other.parent == kFree) {
        other.parent = back;
        other.stamp = own.stamp;
        other.distance = own.distance + 1;
        activate(j);
      } else if (other.stamp <= own.stamp && other.distance > own.distance + 1) {
        other.parent = back;  // a shorter way to the sink
        other.stamp = own.stamp;
        other.distance = own.distance + 1;
      }
      break;
    }
  }
}

/// Fills the way to the sink that begins at `from`, which the source reaches, with `arc`.
void CutSearch::augment(std::int32_t from, std::int32_t arc) {
  std::int32_t flow = node(from).terminal, i = from;
  for (std::int32_t a = arc; a != kTerminal; a = node(i).parent) {
    flow = std::min(flow, left(a));
    i = head(a);
  }
  flow = std::min(flow, -node(i).terminal);
  node(from).terminal -= flow;
  node(i).terminal += flow;
  const auto cut_off = [&](std::int32_t k) {
    node(k).parent = kOrphan;
    orphans_.push_back(k);
  };
  i = from;
  for (std::int32_t a = arc; a != kTerminal;) {
    left(a) -= flow;
    left(mate(a)) += flow;
    if (left(a) == 0 && i != from) cut_off(i);
    i = head(a);
    a = node(i).parent;
  }
  if (node(i).terminal == 0) cut_off(i);
}

/// kFar where the way ends at an orphan. Marks the way, so that it is not walked again in this round.
std::int32_t CutSearch::distance_to_sink(std::int32_t i) {
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
  std::int32_t best = kFree, nearest = kFar;
  for (std::int32_t a = graph_.first_arc(i); a < graph_.last_arc(i); ++a) {
    if (left(a) <= 0 || node(head(a)).parent == kFree) continue;
    const std::int32_t distance = distance_to_sink(head(a));
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
    if (other.parent == kFree) continue;
    if (left(a) > 0) activate(j);
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
    const bool wanted = !n.put_off && n.terminal < 0;
    n.parent = wanted ? kTerminal : kFree;
    if (wanted) activate(i);
  }
  for (std::int32_t i = next_active(); i != kNone; i = next_active()) grow(i);
  for (const std::int32_t i : part) node(i).put_off = false;
}

CutGraph::CutGraph(kernels::Reused<std::int32_t> first, kernels::Reused<Arc> arcs)
    : first_(std::move(first)), arcs_(std::move(arcs)), capacity_(arcs_.size()), nodes_(first_.empty() ? 0 : first_.size() - 1) {}

void CutGraph::cut(std::span<const std::int32_t> part, const Prepare& prepare) { CutSearch(*this, prepare).run(part); }

}  // namespace swarmfit::common
