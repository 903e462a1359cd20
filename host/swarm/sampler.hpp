// Minimal samples of the data, from anywhere or from nearby points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/random.hpp"

namespace swarmfit::swarm {

class Sampler {
 public:
  /// `candidates`: input indices that samples are drawn from, neighbours in the list being neighbours in space.
  Sampler(const models::WorkingPoints& points, std::span<const std::uint32_t> candidates, const models::ModelSpace& space,
          const Random& random);

  /// A model through a sample. `local`: of nearby points. False if some tens of samples were all degenerate.
  bool draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const;

  /// Leaves out candidates whose cap has sunk below half of `full`, as long as enough remain.
  void prefer_unexplained(std::span<const float> caps, float full);

 private:
  const models::WorkingPoints& points_;
  const models::ModelSpace& space_;
  const Random& random_;
  std::span<const std::uint32_t> candidates_;
  std::vector<std::uint32_t> live_;
};

}  // namespace swarmfit::swarm
