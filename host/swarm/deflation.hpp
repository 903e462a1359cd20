// Residual deflation: what a found model explains sinks out of the landscape, and only that.
#pragma once

#include <span>

#include "host/swarm/payment.hpp"

namespace swarmfit::swarm {

/// How far from a model its own points lie, in units of tau, >= 1. Counted over unexplained points in slabs of tau: where a sensor's noise
/// exceeds tau the slabs next to the model hold its tail, which would be found again as splinters parallel to it.
int tail_reach(const Support& support);

/// c_i <- min(c_i, max(0, slope (|dist_i| - reach tau_i))): nothing is left of points within reach, all of those well beyond it.
/// NaN distances change nothing. `allowed`: tau_i, one a point, or empty where it is tau for all.
void deflate(std::span<const float> distances, float tau, int reach, double slope, std::span<float> caps,
             std::span<const float> allowed = {});

}  // namespace swarmfit::swarm
