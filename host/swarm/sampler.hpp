// Minimal samples of the data, from anywhere or from nearby points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/models/neighbours.hpp"
#include "host/swarm/random.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

class Sampler {
 public:
  /// `candidates`: input indices that samples are drawn from, neighbours in the list being neighbours in space.
  /// `neighbours`: of the candidates among themselves; where empty, neighbours in the list are nearby.
  Sampler(const models::WorkingPoints& points, std::span<const std::uint32_t> candidates, const models::Neighbours& neighbours,
          const models::ModelSpace& space, const Random& random);

  /// Whose sample is drawn.
  struct Ask {
    std::uint32_t particle = 0;
    bool local = false;  ///< of nearby points
  };
  /// A model through a sample for each that asks. `drawn` is 0 where some tens of samples were all degenerate, else 1. What one gets has
  /// nothing to do with who else asks.
  void draw(std::span<const Ask> asks, std::uint32_t round, std::uint32_t step, std::span<models::Position> thetas,
            std::span<std::uint8_t> drawn) const;
  /// Models through `count` samples, of every `local_every` of them the first a local one; fewer where some are degenerate.
  kernels::Reused<models::Position> draw_some(std::uint32_t count, std::uint32_t local_every, std::uint32_t round) const;

  /// Leaves out candidates whose cap, one a candidate, has sunk below `least`, as long as enough remain.
  void prefer_unexplained(std::span<const float> caps, float least);
  /// Draws from candidates of which marks, one a point, are not 0 alone; false, and nothing changes, where these are hardly more than a
  /// sample.
  bool keep_to(std::span<const float> marks);

 private:
  /// Leaves out candidates at places of which stays(place) does not hold; all are left where that leaves fewer than `enough`.
  template <class Stays>
  bool leave_out(const Stays& stays, std::size_t enough);

  const models::WorkingPoints& points_;
  const models::ModelSpace& space_;
  const Random& random_;
  /// The points of one attempt at a sample.
  void choose(const Ask& ask, std::uint32_t round, std::uint32_t step, std::uint32_t attempt, std::span<std::uint32_t> sample) const;
  /// Fills places with others near the live candidate at `first`; false where too few are live.
  bool nearby(std::size_t first, std::span<const std::uint32_t> words, std::span<std::uint32_t> places) const;

  std::span<const std::uint32_t> candidates_;
  const models::Neighbours& neighbours_;
  kernels::Reused<std::uint32_t> live_;  // places in candidates_
  kernels::Reused<std::uint8_t> alive_;  // one a candidate, where neighbours are known
};

}  // namespace swarmfit::swarm
