// Who owns a point where points are few: the nearest model within the threshold, if the model reaches as far as that.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/working_points.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// A model goes on for ever where what was seen of it ends: of a segment's line, outliers beyond its ends are within the threshold, too.
/// A point belongs to a model where the density of the model's points about it outweighs that of the outliers beside them (Bayes' rule):
///
///   n p(d | model) > b p(d | outlier),  p(d | model) half a Gaussian of tau / 2.5, p(d | outlier) level,
///
/// with n and b counted among the nearest of the points that lie along the model and are no other model's, as many as one slab tau wide
/// holds. Gives 0, none, or k for the k-th model.
///
/// `distances`: of each model, one a point, levelled so that tau is the threshold of each; NaN where a point is not finite.
kernels::Reused<std::uint16_t> label_locally(const models::WorkingPoints& points, std::span<const kernels::Reused<float>> distances,
                                             float tau);

}  // namespace swarmfit::swarm
