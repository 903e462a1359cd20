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

/// Which bit of a word is the one after `before` others, of at least that many.
std::size_t bit_after(std::uint64_t bits, std::size_t before) {
  for (; before > 0; --before) bits &= bits - 1;
  return static_cast<std::size_t>(std::countr_zero(bits));
}

}  // namespace

std::vector<std::uint32_t> WorkingPoints::finite_at(std::span<const std::size_t> places) const {
  constexpr std::size_t kWord = 64;
  std::vector<std::uint32_t> found(places.size());
  std::size_t word = 0, before = 0;  // finite points in the words before
  std::size_t here = survey_.finite.empty() ? 0 : static_cast<std::size_t>(std::popcount(survey_.finite[0]));
  for (std::size_t k = 0; k < places.size(); ++k) {
    while (before + here <= places[k]) {
      before += here;
      const std::uint64_t bits = survey_.finite[++word];
      // Most words of a dense cloud are full.
      here = bits == ~std::uint64_t{0} ? kWord : static_cast<std::size_t>(std::popcount(bits));
    }
    const std::size_t rank = places[k] - before;
    found[k] = static_cast<std::uint32_t>(word * kWord + (here == kWord ? rank : bit_after(survey_.finite[word], rank)));
  }
  return found;
}

}  // namespace swarmfit::models
