// Minimal samples of the data, from anywhere or from nearby points.
#pragma once

#include <cstdint>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/random.hpp"

namespace swarmfit::swarm {

class Sampler {
 public:
  /// Keeps a subset of the points in Morton order, whose neighbours in the order are neighbours in space.
  Sampler(const models::WorkingPoints& points, const models::ModelSpace& space, const Random& random);

  /// A model through a sample. `local`: of nearby points. False if some tens of samples were all degenerate.
  bool draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const;

  /// Points of which nothing is left to explain are not sampled; `caps` one a point, `full` the cap of an unexplained one.
  void prefer_unexplained(std::span<const float> caps, double full_share, float full);

 private:

  const models::WorkingPoints& points_;
  const models::ModelSpace& space_;
  const Random& random_;
  std::vector<std::uint32_t> ordered_;   // subset, in Morton order
  std::vector<std::uint32_t> live_;      // of ordered_, those not explained yet
};

}  // namespace swarmfit::swarm
