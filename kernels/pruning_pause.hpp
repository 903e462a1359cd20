// Whether it pays to look at a swarm's blocks before its points, as far as the swarms before it tell.
#pragma once

#include <algorithm>

namespace swarmfit::kernels {

/// Where too many residuals are computed all the same, pruning pauses, for twice as long each time up to the longest pause.
class PruningPause {
 public:
  /// `poor`: share of the residuals above which it does not pay, in (0, 1].
  explicit PruningPause(double poor) noexcept : poor_(poor) {}

  /// New points or caps: what was learnt is void.
  void forget() noexcept { left_ = last_ = 0; }
  /// Asked once a swarm.
  bool now() noexcept { return left_ == 0 || left_-- == 0; }
  /// Share of the residuals that a pruned swarm computed.
  void note(double share) noexcept {
    last_ = share > poor_ ? std::clamp(2 * last_, 1, kLongest) : 0;
    left_ = last_;
  }

 private:
  static constexpr int kLongest = 32;
  double poor_;
  int left_ = 0;  ///< swarms to go before it is tried again
  int last_ = 0;
};

}  // namespace swarmfit::kernels
