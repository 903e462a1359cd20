// Many lines or planes that fly a step, each towards two places: on vectors, on the caller's thread.
#pragma once

#include <cstddef>

#include "kernels/reused.hpp"

namespace swarmfit::kernels {

/// Columns of a swarm whose positions are a unit normal and an offset: one row for each of their entries, and in it a place for each
/// particle.
class HyperplaneFlight {
 public:
  enum Row : std::size_t { position, velocity, own, best, pull_own, pull_best, kRows };

  /// axes: 2 or 3, entries of the normal.
  HyperplaneFlight(std::size_t axes, std::size_t count);

  std::size_t axes() const noexcept { return axes_; }
  /// A multiple of every vector's lanes; places beyond the particles' hold zeros.
  std::size_t places() const noexcept { return places_; }
  /// Of one entry, 0 <= entry <= axes; the last is the offset.
  double* row(Row which, std::size_t entry) noexcept { return values_.data() + (which * (axes_ + 1) + entry) * places_; }

  /// Eq. (1) of Zhou et al. 2010. For each particle v <- inertia v + pull_own (own - x) + pull_best (best - x), entry by entry, and
  /// x <- x + v: differences of normals are ways on the sphere, n and -n being one, a quarter turn at most is flown, and the velocity is
  /// carried along. A particle that would get anywhere not finite stays where it is and stands still.
  void step(double inertia);

 private:
  std::size_t axes_, places_;
  Reused<double> values_;
};

}  // namespace swarmfit::kernels
