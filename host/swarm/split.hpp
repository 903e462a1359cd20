// A plane that runs across two surfaces where they meet may save more than either, though less than both: what is best first is not best.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "host/swarm/payment.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {

/// A plane that has been found, and what is left to explain.
struct Suspect {
  const models::Position& theta;
  std::span<const float> distances;  ///< of all points [data unit]
  std::span<const float> caps;       ///< of all points
  std::size_t least;                 ///< points that a model must have
};

/// Are a plane's own points as far off as if it ran across something? Noise is less in most clouds.
bool looks_loose(const Support& support, double tau);

/// Two planes that cross, and that explain the points around a suspect so much better than it that both must have been meant; none if there
/// are no such. They are looked for among planes through neighbouring points of the suspect's own, on a few of the points around it: `part`
/// is of planes, its points in an order in which neighbours are neighbours in space. `number`: of the search, for its random numbers.
Expected<std::optional<std::array<models::Position, 2>>> crossing_pair(const Ground& part, const Suspect& suspect, const Random& random,
                                                                       std::uint32_t number);

}  // namespace swarmfit::swarm
