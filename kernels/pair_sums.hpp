// Least squares on correspondences: the sums over their residuals that a step of a homography or a fundamental matrix asks for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace swarmfit::kernels {

enum class PairResidual : std::uint8_t {
  homography,   ///< transfer into the second image, over the root of its covariance (Sampson); two components
  fundamental,  ///< epipolar constraint over its deviation (Sampson); one component
};

/// Correspondences x1, y1, x2, y2, row by row, and the weight of each. Sizes must agree.
struct WeightedPairs {
  std::span<const double> rows, weights;
};

/// Residuals are whitened: under equal independent noise in every column each component has that noise's deviation. What is not defined, or
/// not finite, at a correspondence is left out of the sums.
struct PairSums {
  std::array<double, 81> information{};  ///< J^T W J over the matrix's nine entries, row by row
  std::array<double, 9> gradient{};      ///< J^T W r
  double squares = 0;                    ///< r^T W r
  std::size_t used = 0;                  ///< correspondences where it is defined
};

/// Adds to the sums. `matrix`: nine entries, row by row.
void add_pair_sums(PairResidual residual, const double* matrix, const WeightedPairs& pairs, PairSums& sums);

/// r^T W r alone; infinite if the residual is not defined at a correspondence.
double pair_squares(PairResidual residual, const double* matrix, const WeightedPairs& pairs);

}  // namespace swarmfit::kernels
