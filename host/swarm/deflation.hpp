// Residual deflation: what a found model explains sinks out of the landscape, and only that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "host/models/working_points.hpp"
#include "host/swarm/payment.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// How far from a model its own points lie, in units of tau, >= 1. Counted over unexplained points in slabs of tau: where a sensor's noise
/// exceeds tau the slabs next to the model hold its tail, which would be found again as splinters parallel to it.
int tail_reach(const Support& support);

/// Where a tail of unexplained points is no noise of the plane's own, but another surface beside it, as the far part of a wall that bends:
/// there the plane itself has few points. `reach` one a point: that of the tail, or 1.
kernels::Reused<float> local_reach(const models::WorkingPoints& points, const Eigen::Vector3d& normal, std::span<const float> distances,
                                   std::span<const float> caps, float tau, int reach);

/// Where points are beside what has been found.
struct Near {
  kernels::Reused<std::uint8_t> beside = {};  ///< one a point: is it less than kSlabs tau_i from a found model? Empty until there is one
  kernels::Reused<float> nearest = {};  ///< one a point, where points may be shared: how far the nearest found model is, where tau_i is tau
};

/// What a found model takes with it.
struct DeadZone {
  float tau = 0;                        ///< [data unit]
  std::span<const float> allowed = {};  ///< tau_i, one a point, or empty where it is tau for all
  int reach = 1;                        ///< how far from the model nothing is left [tau_i]
  kernels::Reused<float> reaches = {};  ///< that of each point, or empty
  double slope = 0;
};

/// c_i <- min(c_i, max(0, slope (|dist_i| - reach tau_i))): nothing is left of points within reach, all of those well beyond it.
/// `distances` are of a run of points, from `first` on; NaN changes nothing. Of these points `near` learns where the model is, in those of
/// its lists that are not empty.
void deflate(std::span<const float> distances, const DeadZone& zone, std::size_t first, std::span<float> caps, Near& near);

}  // namespace swarmfit::swarm
