// The bounds of the seam's arguments, checked alike by every back end.
#pragma once

#include <vector>

#include "kernels/fitness_evaluator.hpp"
#include "kernels/own/own_model.hpp"

namespace swarmfit::kernels {

Result<> check_points(const PointsView& points);
/// `finite[i]` says whether point i is finite; caps of other points are not looked at.
Result<> check_caps(std::span<const float> caps, std::span<const std::uint8_t> finite);
Result<> check_size(const char* field, std::size_t value, std::size_t wanted);

// `own`: the one model that the evaluator was made for; null where it has those that are built in.
Result<> check_swarm(const SwarmView& swarm, int dimension, std::span<const float> cutoffs, std::span<const float> costs,
                     const OwnModel* own = nullptr);
Result<> check_model(const ModelView& model, int dimension, const OwnModel* own = nullptr);
Result<> check_assign(std::span<const ModelView> models, int dimension, std::size_t points, std::span<const float> tolerance,
                      std::span<const std::uint16_t> labels, const OwnModel* own = nullptr);
Result<> check_weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<const float> distances,
                     std::span<const Evidence> evidence, const OwnModel* own = nullptr);
Result<> check_claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                     std::span<const std::uint16_t> labels, std::span<const Evidence> evidence, const OwnModel* own = nullptr);

/// Finite flags of a cloud and the centre that makes its coordinates small: the middle of its bounding box.
struct Extent {
  std::vector<std::uint8_t> finite;
  std::size_t finite_count = 0;
  double centre[kMaxDimension] = {};
};
Extent measure(const PointsView& points);

}  // namespace swarmfit::kernels
