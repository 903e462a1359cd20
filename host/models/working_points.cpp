#include "host/models/working_points.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Dense>

namespace swarmfit::models {

kernels::PointsView to_kernel(const PointsView& points) noexcept {
  const auto scalar = points.scalar() == PointsView::Scalar::float32 ? kernels::Scalar::float32 : kernels::Scalar::float64;
  return {points.data(), scalar, points.dimension(), points.size(), points.stride()};
}

std::optional<Stray> find_stray(const kernels::PointsView& points) {
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!points.finite(i)) continue;
    for (int d = 0; d < points.dimension; ++d) {
      if (std::abs(points.at(i, d)) > kFarthest) return Stray{i, d, points.at(i, d)};
    }
  }
  return std::nullopt;
}

std::string text_of(const Stray& stray) {
  return fmt::format("point {}, column {}: {:g}, must be in -{}..{}", stray.point + 1, stray.column + 1, stray.value, kFarthest, kFarthest);
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
  reach_ = Eigen::Map<const Eigen::Vector4d>(frame_.centre.data()).norm() + std::sqrt(scatter.trace());
  scatter /= static_cast<double>(survey_.finite_count);
  const double variance = scatter.trace();
  frame_.scale = variance > 0 && std::isfinite(variance) ? std::sqrt(variance) : 1.0;
  per_scale_ = 1 / frame_.scale;
  const Eigen::Vector4d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(scatter, Eigen::EigenvaluesOnly).eigenvalues();
  // Float coordinates of a perfect line leave it by some 1e-7 of their size.
  const double size = spread[3];
  for (int d = 0; d < 4; ++d) rank_ += spread[d] > 1e-12 * size ? 1 : 0;
}

namespace {

constexpr std::size_t kWord = 64;

/// Most words of a dense cloud are full.
std::size_t ones(std::uint64_t bits) { return bits == ~std::uint64_t{0} ? kWord : static_cast<std::size_t>(std::popcount(bits)); }

constexpr std::uint64_t kEachByte = 0x0101010101010101U, kHighBits = 0x8080808080808080U;

/// Place of the (r+1)th set bit of a byte.
constexpr std::array<std::array<std::uint8_t, 8>, 256> places_in_byte() {
  std::array<std::array<std::uint8_t, 8>, 256> places{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned rank = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if ((byte >> bit & 1U) != 0) places[byte][rank++] = static_cast<std::uint8_t>(bit);
    }
  }
  return places;
}
constexpr auto kPlaces = places_in_byte();

/// Which bit of a word is the one after `before` others, of at least that many: its byte by counts side by side, and its place there.
std::size_t bit_after(std::uint64_t bits, std::size_t before) {
  std::uint64_t counts = bits - (bits >> 1 & 0x5555555555555555U);
  counts = (counts & 0x3333333333333333U) + (counts >> 2 & 0x3333333333333333U);
  counts = ((counts + (counts >> 4)) & 0x0F0F0F0F0F0F0F0FU) * kEachByte;  // of each byte and those below it
  const std::uint64_t passed = ((before * kEachByte | kHighBits) - counts) & kHighBits;
  const auto byte = static_cast<std::size_t>((passed >> 7) * kEachByte >> 56);
  const std::size_t below = byte > 0 ? counts >> (8 * byte - 8) & 0xFFU : 0;
  return 8 * byte + kPlaces[bits >> (8 * byte) & 0xFFU][before - below];
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
