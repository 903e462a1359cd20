// Residual deflation: what a found model explains sinks out of the landscape, and only that.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "host/models/working_points.hpp"
#include "host/swarm/payment.hpp"

namespace swarmfit::swarm {

/// How far from a model its own points lie, in units of tau, >= 1. Counted over unexplained points in slabs of tau: where a sensor's noise
/// exceeds tau the slabs next to the model hold its tail, which would be found again as splinters parallel to it.
int tail_reach(const Support& support);

/// Where a tail of unexplained points is no noise of the plane's own, but another surface beside it, as the far part of a wall that bends:
/// there the plane itself has few points. `reach` one a point: that of the tail, or 1.
std::vector<float> local_reach(const models::WorkingPoints& points, const Eigen::Vector3d& normal, std::span<const float> distances,
                               std::span<const float> caps, float tau, int reach);

/// c_i <- min(c_i, max(0, slope (|dist_i| - reach tau_i))): nothing is left of points within reach, all of those well beyond it.
/// NaN distances change nothing. `reaches`: reach of each point, or empty. `allowed`: tau_i, one a point, or empty where it is tau for all.
void deflate(std::span<const float> distances, float tau, int reach, double slope, std::span<float> caps,
             std::span<const float> allowed = {}, std::span<const float> reaches = {});

}  // namespace swarmfit::swarm
