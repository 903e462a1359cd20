// Sums and marks over what is known of points already, one number a point, in the caller's memory: on vectors, on the caller's thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace swarmfit::kernels {

/// Points on both sides of a model in slabs of one width: those less than it away, those from there to twice it, and so on.
struct SlabCounts {
  static constexpr std::size_t kSlabs = 7;
  std::size_t open = 0;  ///< all open points
  std::array<std::size_t, kSlabs> slabs{};
  double square = 0;       ///< of the first slab: sum of the squared distances
  std::size_t inner = 0;   ///< of the first slab, those less than half its width away
  std::size_t marked = 0;  ///< of the first slab, those that are marked
  std::size_t shared = 0;  ///< points that are not open, less than the width away, and nearer than to another model that is as near
};

/// What there is to count: one value a point, NaN a distance that counts for nothing. A point is open if its cap is at least `least_cap`.
struct SlabsView {
  std::span<const float> distances, caps;
  std::span<const std::uint8_t> marks;  ///< empty, or 0 or 1 a point
  std::span<const float> others;        ///< empty, and no point is shared, or distances to another model
  float width = 0, least_cap = 0;
};

/// Adds to the counts.
void count_slabs(const SlabsView& view, SlabCounts& counts);

/// How a found model sinks what it explains. Widths and reaches are one for all points, or one a point.
struct Sinking {
  float width = 0;                      ///< of a slab, > 0 [unit of the distances]
  std::span<const float> widths = {};   ///< empty, or that of each point
  float reach = 0;                      ///< slabs of which nothing is left
  std::span<const float> reaches = {};  ///< empty, or those of each point
  float slope = 0;                      ///< of what is left beyond them
  float marked = 0;                     ///< slabs of which points are marked
};

/// What a found model leaves of the points. caps[i] is at most slope (distance - reach_i width_i), and at least 0; marks[i] = 1 where the
/// distance is less than `marked` slabs; others[i] is at most the distance in measures that make the width of each point `width`. Marks and
/// others may be empty. NaN changes nothing.
void sink(std::span<const float> distances, const Sinking& how, std::span<std::uint8_t> marks, std::span<float> others,
          std::span<float> caps);

/// Sum of what the distances are less than the caps; NaN is not less.
double saved(std::span<const float> caps, std::span<const float> distances);

/// How distances come to count by their logarithm, so that small ones tell more than large ones.
struct Bending {
  float unit = 0;      ///< what stays itself, > 0 [unit of the distances]
  float bend = 0;      ///< of the unit, > 0: d becomes unit log(1 + d / (bend unit)) / log(1 + 1 / bend)
  float farthest = 0;  ///< of the unit: what is farther away
  float beyond = 0;    ///< counts so much, of the unit
};

/// In place; NaN stays.
void bend(std::span<float> distances, const Bending& how);

}  // namespace swarmfit::kernels
