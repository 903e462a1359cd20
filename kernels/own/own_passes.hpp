// Passes over the caller's points for own models, in double precision: what evidence.hpp has for the kinds that are built in.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/evidence.hpp"
#include "kernels/own/own_model.hpp"

namespace swarmfit::kernels {

/// Where tasks run: on the threads of the arena that this is called in, or one after another. The answer is the same.
enum class Sharing { serial, threads };

// Arguments are valid (checks.hpp). Points are taken in runs of fixed length, whose sums are added up in a fixed order.
void weigh_own(const OwnModel& own, const PointsView& points, const Weighing& how, std::span<const ModelView> models,
               std::span<float> distances, std::span<Evidence> evidence, Sharing sharing);
void claim_own(const OwnModel& own, const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
               std::span<std::uint16_t> labels, std::span<Evidence> evidence, Sharing sharing);

}  // namespace swarmfit::kernels
