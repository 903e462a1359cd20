#include "host/models/working_points.hpp"

#include <bit>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

namespace swarmfit::models {

kernels::PointsView to_kernel(const PointsView& points) noexcept {
  const auto scalar = points.scalar() == PointsView::Scalar::float32 ? kernels::Scalar::float32 : kernels::Scalar::float64;
  return {points.data(), scalar, points.dimension(), points.size(), points.stride()};
}

namespace {

kernels::Survey survey_of(const PointsView& points) {
  kernels::Survey survey;
  kernels::survey_points(to_kernel(points), survey);
  return survey;
}

}  // namespace

WorkingPoints::WorkingPoints(const PointsView& points) : WorkingPoints(points, survey_of(points)) {}

WorkingPoints::WorkingPoints(const PointsView& points, kernels::Survey survey) : view_(to_kernel(points)), survey_(std::move(survey)) {
  if (survey_.finite_count == 0) return;
  Eigen::Matrix4d scatter;
  for (int d = 0; d < kMaxDimension; ++d) {
    const auto row = static_cast<std::size_t>(d);
    if (d < view_.dimension) frame_.centre[row] = survey_.moments.mean[row];
    for (int e = 0; e < kMaxDimension; ++e) scatter(d, e) = survey_.moments.scatter[row][static_cast<std::size_t>(e)];
  }
  scatter /= static_cast<double>(survey_.finite_count);
  const double variance = scatter.trace();
  frame_.scale = variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : 1.0;
  const Eigen::Vector4d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  // Float coordinates of a perfect line leave it by some 1e-7 of their size.
  const double size = spread[3];
  for (int d = 0; d < 4; ++d) rank_ += spread[d] > 1e-12 * size ? 1 : 0;
}

std::vector<std::uint32_t> WorkingPoints::finite_at(std::span<const std::size_t> places) const {
  std::vector<std::uint32_t> found;
  found.reserve(places.size());
  if (places.empty()) return found;
  // Places rise: each word is counted once and each of its bits passed once.
  std::size_t word = 0, before = 0, passed = 0;  // finite points in the words before, and passed in this one
  std::uint64_t bits = survey_.finite[0];
  auto here = static_cast<std::size_t>(std::popcount(bits));
  for (const std::size_t place : places) {
    while (before + here <= place) {
      before += here;
      bits = survey_.finite[++word];
      here = static_cast<std::size_t>(std::popcount(bits));
      passed = 0;
    }
    for (; passed < place - before; ++passed) bits &= bits - 1;
    found.push_back(static_cast<std::uint32_t>(word * 64 + static_cast<std::size_t>(std::countr_zero(bits))));
  }
  return found;
}

}  // namespace swarmfit::models
