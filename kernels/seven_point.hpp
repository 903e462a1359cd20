// Fundamental matrices through seven correspondences, for several samples side by side: swarms of them take a great many.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace swarmfit::kernels {

/// So many samples are solved at a time, a lane each. Coordinates must be finite; lanes that nobody asks about may hold any such.
inline constexpr std::size_t kSevenPointLanes = 8;

struct SevenPointSamples {
  using Lanes = std::array<double, kSevenPointLanes>;
  /// Columns x1, y1, x2, y2 of each sample's seven correspondences.
  alignas(64) std::array<std::array<Lanes, 4>, 7> points;
};

/// Of each lane, the pencil of matrices that seven epipolar constraints leave, F = one + x other, up to scale and in a frame of the
/// sample's own: its first correspondence is the origin of both images and the others are about one from it; (3, 3) is 0 there. Row by row,
/// the last entry left out.
struct SevenPointPencils {
  using Lanes = SevenPointSamples::Lanes;
  alignas(64) std::array<Lanes, 8> one, other;
  /// Those x at which F has rank 2.
  alignas(64) std::array<Lanes, 3> root;
  /// What coordinates of the first and of the second image were multiplied by, once the origin had been moved.
  alignas(64) std::array<Lanes, 2> scale;
  /// Bit k: the k-th root is real, and there all seven points can lie in front of both cameras. None where the points determine no pencil.
  std::array<std::uint8_t, kSevenPointLanes> kept;
};

/// The null space is that of a Householder factorisation (no pivots, so that lanes go in step); roots are by Halley's iteration.
void solve_seven_points(const SevenPointSamples& samples, SevenPointPencils& pencils);

}  // namespace swarmfit::kernels
