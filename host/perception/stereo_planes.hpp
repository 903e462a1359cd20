// Supporting planes in dense stereo, by the few directions that are known in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/perception/grid.hpp"
#include "host/perception/overview.hpp"
#include "host/perception/surface.hpp"

namespace swarmfit::perception {

/// How many cells of unknown direction one of known direction counts for when planes are fitted: a slab through clutter is made of the
/// former.
inline constexpr std::size_t kWeightOfKnown = 6;

/// Least squares over those of the `chosen` cells that lie within tau [m] of the plane and are known to lie along it; the plane itself
/// where they are too few. Its normal turns to at most `most_angle` [rad] from `up`.
LocalPlane refine_on_known(const Overview& overview, std::span<const std::uint32_t> chosen, const LocalPlane& plane, float tau,
                           const Eigen::Vector3d& up, double most_angle);

/// Whether more of a surface's cells are known to lie along it than would by chance.
bool lies_along(const Overview& overview, const Surface& surface, float tau);

}  // namespace swarmfit::perception
