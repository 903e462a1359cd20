// The end of a fit: found models meet the whole cloud.
#pragma once

#include <span>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {

/// One more round of least absolute deviations for each model, on all points within tau of it: for models that were found on a thinned
/// cloud and are as good as that was large. Models of several kinds (`shared`) have no say in what is nearer to another of them or to one
/// of the `hidden`.
Expected<> refit(const Ground& whole, std::vector<models::Placed>& found, bool shared, std::span<const models::Placed> hidden);

/// Labels of all points, and for each model of the result its parameters, inliers, rms and covariance. `result` holds a model for each of
/// `found`, in that order; what is nearer to one of the `hidden` is nobody's. Where its labels are already one a point, they stay.
/// `corners`: of the loss that each was refined with, of tau.
Expected<> settle(const Ground& whole, const std::vector<models::Placed>& found, std::span<const models::Placed> hidden,
                  std::span<const float> corners, FitResult& result);

}  // namespace swarmfit::swarm
