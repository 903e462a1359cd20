// Whether it pays to look at a swarm's blocks before its points, as far as the swarms before it tell.
#pragma once

#include <algorithm>

namespace swarmfit::kernels {

/// Where too many residuals are computed all the same, pruning pauses, for twice as long each time up to the longest pause.
class PruningPause {
 public:
  /// New points or caps: what was learnt is void.
  void forget() noexcept {
    left_ = last_ = 0;
    proven_ = false;
  }
  /// Asked once a swarm.
  bool now() noexcept { return left_ == 0 || left_-- == 0; }
  /// Did it pay the last time, since when nothing new was learnt?
  bool proven() const noexcept { return proven_; }
  /// `share` of the residuals that a pruned swarm, or the part of it that was to tell, computed; above `poor`, both in [0, 1], it does not pay.
  void note(double share, double poor) noexcept {
    last_ = share > poor ? std::clamp(2 * last_, kFirst, kLongest) : 0;
    left_ = last_;
    proven_ = share <= poor;
  }

 private:
  static constexpr int kFirst = 4, kLongest = 32;
  int left_ = 0;  ///< swarms to go before it is tried again
  int last_ = 0;
  bool proven_ = false;
};

}  // namespace swarmfit::kernels
