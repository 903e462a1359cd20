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
  const int dim = view_.dimension;
  Eigen::Vector4d first = Eigen::Vector4d::Zero(), sum = Eigen::Vector4d::Zero();
  Eigen::Matrix4d square = Eigen::Matrix4d::Zero();
  finite_.assign(view_.count, 0);
  for (std::size_t i = 0; i < view_.count; ++i) {
    if (!view_.finite(i)) continue;
    finite_[i] = 1;
    Eigen::Vector4d x = Eigen::Vector4d::Zero();
    for (int d = 0; d < dim; ++d) x[d] = view_.at(i, d);
    // Sums are taken relative to the first finite point, so that coordinates of 5e6 m lose nothing.
    if (finite_count_ == 0) first = x;
    x -= first;
    sum += x;
    square.noalias() += x * x.transpose();
    ++finite_count_;
  }
  if (finite_count_ > 0) describe(first, sum / static_cast<double>(finite_count_), square / static_cast<double>(finite_count_));
  if (finite_count_ == view_.count) {
    finite_.clear();
    return;
  }
  index_.reserve(finite_count_);
  for (std::size_t i = 0; i < view_.count; ++i) {
    if (finite_[i]) index_.push_back(static_cast<std::uint32_t>(i));
  }
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
