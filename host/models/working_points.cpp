#include "host/models/working_points.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace swarmfit::models {

kernels::PointsView to_kernel(const PointsView& points) noexcept {
  const auto scalar = points.scalar() == PointsView::Scalar::float32 ? kernels::Scalar::float32 : kernels::Scalar::float64;
  return {points.data(), scalar, points.dimension(), points.size(), points.stride()};
}

WorkingPoints::WorkingPoints(const PointsView& points) : view_(to_kernel(points)) {
  finite_.assign(view_.count, 0);
  if (view_.scalar == kernels::Scalar::float32) {
    look_at<float>();
  } else {
    look_at<double>();
  }
  if (finite_count_ == view_.count) {
    finite_.clear();
    return;
  }
  index_.reserve(finite_count_);
  for (std::size_t i = 0; i < view_.count; ++i) {
    if (finite_[i]) index_.push_back(static_cast<std::uint32_t>(i));
  }
}

template <class T>
void WorkingPoints::look_at() {
  const auto dim = static_cast<std::size_t>(view_.dimension);
  std::array<double, kMaxDimension> first{};
  double sum[kMaxDimension] = {}, square[kMaxDimension][kMaxDimension] = {};
  for (std::size_t i = 0; i < view_.count; ++i) {
    T row[kMaxDimension] = {};
    std::memcpy(row, static_cast<const char*>(view_.data) + i * view_.stride, sizeof(T) * dim);
    T probe = 0;
    for (std::size_t d = 0; d < dim; ++d) probe += row[d] * T{0};  // stays 0 unless a column is NaN or infinite
    if (!(probe == 0)) continue;
    finite_[i] = 1;
    // Sums are taken relative to the first finite point, so that coordinates of 5e6 m lose nothing.
    if (finite_count_++ == 0) std::copy(row, row + kMaxDimension, first.begin());
    double x[kMaxDimension];
    for (std::size_t d = 0; d < kMaxDimension; ++d) x[d] = static_cast<double>(row[d]) - first[d];
    for (std::size_t d = 0; d < kMaxDimension; ++d) {
      sum[d] += x[d];
      for (std::size_t e = d; e < kMaxDimension; ++e) square[d][e] += x[d] * x[e];
    }
  }
  if (finite_count_ == 0) return;
  const auto n = static_cast<double>(finite_count_);
  Eigen::Vector4d mean;
  Eigen::Matrix4d second;
  for (int d = 0; d < kMaxDimension; ++d) {
    mean[d] = sum[d] / n;
    for (int e = d; e < kMaxDimension; ++e) second(d, e) = second(e, d) = square[d][e] / n;
  }
  describe(Eigen::Vector4d(first.data()), mean, second);
}

void WorkingPoints::describe(const Eigen::Vector4d& origin, const Eigen::Vector4d& mean, const Eigen::Matrix4d& square) {
  for (int d = 0; d < view_.dimension; ++d) frame_.centre[static_cast<std::size_t>(d)] = origin[d] + mean[d];
  const Eigen::Matrix4d scatter = square - mean * mean.transpose();
  const double variance = scatter.trace();
  frame_.scale = variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : 1.0;
  const Eigen::Vector4d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  // Float coordinates of a perfect line leave it by some 1e-7 of their size.
  const double size = spread[3];
  rank_ = 0;
  for (int d = 0; d < 4; ++d) rank_ += spread[d] > 1e-12 * size ? 1 : 0;
}

}  // namespace swarmfit::models
