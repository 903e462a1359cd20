// The end of a fit: found models meet the whole cloud.
#pragma once

#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {

/// One more round of least absolute deviations for each model, on all points within tau of it: for models that were found on a thinned
/// cloud and are as good as that was large.
Expected<> refit(const Ground& whole, std::vector<models::Position>& found);

/// Labels of all points, and for each model of the result its parameters, inliers, rms and covariance. `result` holds a model for each of
/// `found`, in that order. Where its labels are already one a point, they stay.
Expected<> settle(const Ground& whole, const std::vector<models::Position>& found, FitResult& result);

}  // namespace swarmfit::swarm
