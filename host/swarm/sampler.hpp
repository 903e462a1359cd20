// Minimal samples of the data, from anywhere or from nearby points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/models/neighbours.hpp"
#include "host/swarm/random.hpp"

namespace swarmfit::swarm {

class Sampler {
 public:
  /// `candidates`: input indices that samples are drawn from, neighbours in the list being neighbours in space.
  /// `neighbours`: of the candidates among themselves; where empty, neighbours in the list are nearby.
  Sampler(const models::WorkingPoints& points, std::span<const std::uint32_t> candidates, const models::Neighbours& neighbours,
          const models::ModelSpace& space, const Random& random);

  /// A model through a sample. `local`: of nearby points. False if some tens of samples were all degenerate.
  bool draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const;

  /// Leaves out candidates whose cap, one a candidate, has sunk below `least`, as long as enough remain.
  void prefer_unexplained(std::span<const float> caps, float least);
  /// Draws from candidates of which marks, one a point, are not 0 alone; false, and nothing changes, where these are hardly more than a sample.
  bool keep_to(std::span<const float> marks);

 private:
  /// Leaves out candidates at places of which stays(place) does not hold; all are left where that leaves fewer than `enough`.
  template <class Stays>
  bool leave_out(const Stays& stays, std::size_t enough);

  const models::WorkingPoints& points_;
  const models::ModelSpace& space_;
  const Random& random_;
  /// Fills places with others near the live candidate at `first`; false where too few are live.
  bool nearby(std::size_t first, std::span<const std::uint32_t> words, std::span<std::uint32_t> places) const;

  std::span<const std::uint32_t> candidates_;
  const models::Neighbours& neighbours_;
  std::vector<std::uint32_t> live_;  // places in candidates_
  std::vector<std::uint8_t> alive_;  // one a candidate
};

}  // namespace swarmfit::swarm
