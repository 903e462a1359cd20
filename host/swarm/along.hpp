// The last refinement of what is round: by those of its points whose surroundings lie along it.
#pragma once

#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {

/// Refines spheres and cylinders of `found` by least absolute deviations on those of their points whose normals lie along them; which
/// points are labelled theirs does not change by it but as they move. On the outline of an object a depth camera mixes it with what is
/// behind it: such points, as outliers, are to one side of a surface more than to the other and pull at its radius, but what they lie on
/// runs across it or is no surface. Points that are nearer to another of `found` or to one of `hidden` have no say. Models of few points
/// stay as they are.
Expected<> refine_along(const Ground& whole, std::vector<models::Placed>& found, std::span<const models::Placed> hidden);

}  // namespace swarmfit::swarm
