#include "kernels/blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace swarmfit::kernels {

void principal_axes(std::array<std::array<double, 3>, 3>& matrix, std::array<std::array<double, 3>, 3>& axes, int dimension) {
  // Jacobi rotations.
  axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto n = static_cast<std::size_t>(dimension);
  for (int sweep = 0; sweep < 4; ++sweep) {
    for (std::size_t p = 0; p < n; ++p) {
      for (std::size_t q = p + 1; q < n; ++q) {
        if (std::abs(matrix[p][q]) < 1e-30) continue;
        const double theta = (matrix[q][q] - matrix[p][p]) / (2 * matrix[p][q]);
        const double t = (theta >= 0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < n; ++k) {
          const double kp = matrix[k][p], kq = matrix[k][q];
          matrix[k][p] = c * kp - s * kq;
          matrix[k][q] = s * kp + c * kq;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double pk = matrix[p][k], qk = matrix[q][k];
          matrix[p][k] = c * pk - s * qk;
          matrix[q][k] = s * pk + c * qk;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double kp = axes[k][p], kq = axes[k][q];
          axes[k][p] = c * kp - s * kq;
          axes[k][q] = s * kp + c * kq;
        }
      }
    }
  }
}

namespace {

/// A block's points about their mean, in columns; weight 1 where there is a cap, else 0 and at the mean.
struct Centred {
  alignas(64) std::array<std::array<float, kBlockPoints>, 3> offset{};
  alignas(64) std::array<float, kBlockPoints> weight{};
};

/// In kStrands sums side by side, whatever the compiler makes of it: the rounding of each is at most kSumRounding of its terms' sizes.
constexpr std::size_t kStrands = 16;
constexpr float kSumRounding = kBlockPoints / kStrands * std::numeric_limits<float>::epsilon() / 2;
float dot(const float* a, const float* b) {
  std::array<float, kStrands> strand{};
  for (std::size_t i = 0; i < kBlockPoints; i += kStrands) {
#pragma omp simd
    for (std::size_t s = 0; s < kStrands; ++s) strand[s] += a[i + s] * b[i + s];
  }
  return static_cast<float>(std::accumulate(strand.begin(), strand.end(), 0.0));
}

/// Fills all that needs no axes. The loops here are plain so that compilers turn them into vectors.
void centre_block(const float* const* columns, const float* caps, std::size_t width, Centred& centred, BlockBounds& bounds) {
  constexpr float kNone = std::numeric_limits<float>::max();
  float count = 0, cap_sum = 0, least = kNone, most = 0;
#pragma omp simd reduction(+ : count, cap_sum) reduction(min : least) reduction(max : most)
  for (std::size_t i = 0; i < kBlockPoints; ++i) {
    const float weight = caps[i] > 0 ? 1.0F : 0.0F;
    const float low = caps[i] > 0 ? caps[i] : kNone;
    centred.weight[i] = weight;
    count += weight;
    cap_sum += caps[i];
    least = least < low ? least : low;
    most = most > caps[i] ? most : caps[i];
  }
  bounds.count = count;
  if (count == 0) return;
  bounds.cap_sum = cap_sum;
  bounds.least_cap = least;
  bounds.most_cap = most;
  for (std::size_t c = 0; c < width; ++c) {
    const float* column = columns[c];
    const float* weight = centred.weight.data();
    float* offset = centred.offset[c].data();
    const float mean = bounds.mean[c] = dot(weight, column) / count;
#pragma omp simd
    for (std::size_t i = 0; i < kBlockPoints; ++i) offset[i] = weight[i] * (column[i] - mean);
  }
}

/// The box and the signed sums along one axis, of unit length.
void bound_axis(const Centred& centred, const std::array<float, 3>& axis, double variance, std::size_t width, std::size_t e,
                BlockBounds& bounds) {
  alignas(64) std::array<float, kBlockPoints> sign;
  const float *x = centred.offset[0].data(), *y = centred.offset[1].data(), *z = centred.offset[2].data();
  float reach = 0, signs = 0;
#pragma omp simd reduction(+ : signs) reduction(max : reach)
  for (std::size_t i = 0; i < kBlockPoints; ++i) {
    const float along = axis[0] * x[i] + axis[1] * y[i] + axis[2] * z[i];
    const float size = std::abs(along);
    reach = reach > size ? reach : size;
    sign[i] = std::copysign(centred.weight[i], along);
    signs += sign[i];
  }
  for (std::size_t c = 0; c < width; ++c) {
    bounds.axis[e][c] = axis[c] * reach;
    bounds.signed_offset[e][c] = dot(sign.data(), centred.offset[c].data());
  }
  const double square = static_cast<double>(reach) * static_cast<double>(reach);
  bounds.spread[e] = square > 0 ? static_cast<float>(variance / square) : 0.0F;
  bounds.sign_sum[e] = signs;
}

float box_radius(const BlockBounds& bounds, std::size_t width) {
  double square = 0;
  for (std::size_t e = 0; e < width; ++e) {
    for (std::size_t c = 0; c < width; ++c) square += static_cast<double>(bounds.axis[e][c]) * static_cast<double>(bounds.axis[e][c]);
  }
  return static_cast<float>(std::sqrt(square) * (1 + 1e-5));
}

}  // namespace

BlockBounds bound_block(const float* const* columns, const float* caps, int dimension) {
  const auto width = static_cast<std::size_t>(dimension);
  BlockBounds bounds;
  Centred centred;
  centre_block(columns, caps, width, centred, bounds);
  if (bounds.count == 0) return bounds;
  std::array<std::array<double, 3>, 3> covariance{}, axes{};
  for (std::size_t a = 0; a < width; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      const float sum = dot(centred.offset[a].data(), centred.offset[b].data());
      covariance[a][b] = covariance[b][a] = static_cast<double>(sum) / static_cast<double>(bounds.count);
    }
  }
  principal_axes(covariance, axes, dimension);
  // What the sums above and the axes' own rounding may have added to the variance in any direction; it may well make one negative.
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  const double rounding = 4.0 * static_cast<double>(kSumRounding) * trace;
  for (std::size_t e = 0; e < width; ++e) {
    const std::array<float, 3> axis{static_cast<float>(axes[0][e]), static_cast<float>(axes[1][e]), static_cast<float>(axes[2][e])};
    bound_axis(centred, axis, covariance[e][e] - rounding, width, e, bounds);
  }
  bounds.mean_square = static_cast<float>(trace + rounding);
  bounds.radius = box_radius(bounds, width);
  return bounds;
}

}  // namespace swarmfit::kernels
