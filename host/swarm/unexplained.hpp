// What is left to explain.
#pragma once

#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/swarm/deflation.hpp"
#include "host/swarm/problem.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// A cap for each point, which sinks with what explains the point, and where what was found is. Under parametric deflation the caps only
/// tell what a model still explains: swarms see those of the beginning.
class Unexplained {
 public:
  explicit Unexplained(const Problem& problem) : problem_(problem) {}

  /// One a point of the cloud [data unit]; 0 where it is not finite.
  std::vector<float>& caps() noexcept { return caps_; }
  const std::vector<float>& caps() const noexcept { return caps_; }
  Near& near() noexcept { return near_; }
  const Near& near() const noexcept { return near_; }
  /// Those of the part's points, as they were shown last.
  const std::vector<float>& part_caps() const noexcept { return part_caps_; }

  /// All of it is left.
  void restore();
  /// Swarms see these from now on.
  Expected<> show(std::span<const float> caps);
  Expected<> show() { return show(caps_); }
  /// Of points whose cap is at least half of their threshold.
  std::size_t count() const noexcept;

 private:
  const Problem& problem_;
  kernels::Reused<float> caps_, part_caps_;
  Near near_;
};

}  // namespace swarmfit::swarm
