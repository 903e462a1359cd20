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

namespace {

constexpr std::size_t kWord = 64;

/// Most words of a dense cloud are full.
std::size_t ones(std::uint64_t bits) { return bits == ~std::uint64_t{0} ? kWord : static_cast<std::size_t>(std::popcount(bits)); }

/// Which bit of a word is the one after `before` others, of at least that many.
std::size_t bit_after(std::uint64_t bits, std::size_t before) {
  for (; before > 0; --before) bits &= bits - 1;
  return static_cast<std::size_t>(std::countr_zero(bits));
}

}  // namespace

std::uint32_t FiniteWalk::to(std::size_t place) {
  while (before_ + here_ <= place) {
    before_ += here_;
    here_ = ones(finite_[++word_]);
  }
  const std::size_t rank = place - before_;
  return static_cast<std::uint32_t>(word_ * kWord + (here_ == kWord ? rank : bit_after(finite_[word_], rank)));
}

FiniteWalk WorkingPoints::walk() const { return FiniteWalk(survey_.finite, survey_.finite.empty() ? 0 : ones(survey_.finite[0])); }

}  // namespace swarmfit::models
