// How the noise of a sensor differs from point to point.
#pragma once

#include <span>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/working_points.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// What a noise model needs to know of a whole cloud: the |z| that three in ten of its finite points do not reach [data unit].
double near_depth(const models::WorkingPoints& points);

/// For each point how many times the threshold it may be off, >= 1: tau_i / tau = max(1, (z_i / reference)^2). Empty where that is 1 for
/// all.
kernels::Reused<float> spread_of(Noise noise, const models::WorkingPoints& points, double reference);

/// The thresholds themselves, one a point; empty where the spread is.
kernels::Reused<float> allowed_by(std::span<const float> spread, float tau);

}  // namespace swarmfit::swarm
