// Spatial blocks: runs of points that lie close together, so that one bound speaks for all of them (see docs/method.md).
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "kernels/models/models.hpp"

namespace swarmfit::kernels {

/// Points of a block. The last one of a cloud is padded.
inline constexpr std::size_t kBlockPoints = 256;

/// The box of a block and sums from which costs are bounded, over the points whose cap is not 0; everything in float, with room left for
/// its rounding by the user. Axes are the principal ones, so that a patch of a plane has a flat box.
struct BlockBounds {
  static constexpr int kSigns = 3;
  float count = 0;  ///< points with a cap > 0
  float mean[3] = {};
  float axis[3][3] = {};  ///< principal axes, each as long as the box's half extent about the mean
  float spread[3] = {};   ///< variance along the axis, less its rounding, over the square of its length
  float radius = 0;       ///< of a ball about the mean that holds the box
  float mean_square = 0;  ///< of the points' distances from the mean, and its rounding
  float least_cap = 0;    ///< of caps > 0
  float most_cap = -std::numeric_limits<float>::infinity();
  float cap_sum = 0;
  /// For signs s_i of +1 and -1, |sum s_i d_i| <= sum |d_i|: sum s_i (x_i - mean) and sum s_i. The signs are those of the points'
  /// offsets along the principal axes; the flattest axis tells the noise, which no plane can go below.
  float signed_offset[kSigns][3] = {};
  float sign_sum[kSigns] = {};
};

/// Eigenvectors of a covariance of two or three dimensions, as the columns of `axes`; it becomes diagonal.
void principal_axes(std::array<std::array<double, 3>, 3>& covariance, std::array<std::array<double, 3>, 3>& axes, int dimension);

}  // namespace swarmfit::kernels
