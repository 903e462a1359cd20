#include "host/swarm/subset.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace swarmfit::swarm {
namespace {

/// Interleaves the bits of the quantised columns.
std::uint64_t morton(const models::WorkingPoints& points, std::size_t i) {
  const int dim = points.dimension();
  constexpr int bits = 16;
  std::array<std::uint32_t, models::kMaxDimension> cell{};
  for (int d = 0; d < dim; ++d) {
    // The working frame has unit spread: +-4 holds all but far outliers, which are clamped.
    const double t = std::clamp((points.at(i, d) + 4.0) / 8.0, 0.0, 1.0);
    cell[static_cast<std::size_t>(d)] = static_cast<std::uint32_t>(t * ((1U << bits) - 1U));
  }
  std::uint64_t code = 0;
  for (int b = bits - 1; b >= 0; --b) {
    for (int d = 0; d < dim; ++d) code = (code << 1) | ((cell[static_cast<std::size_t>(d)] >> b) & 1U);
  }
  return code;
}

}  // namespace

Subset::Subset(const models::WorkingPoints& points, const Random& random, std::size_t size) : dimension_(points.dimension()) {
  const std::size_t n = points.finite_count();
  const std::size_t kept = std::min(n, size);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> coded(kept);
  for (std::size_t k = 0; k < kept; ++k) {
    std::size_t at = k;
    if (kept < n) {
      const std::size_t from = n * k / kept, to = n * (k + 1) / kept;
      at = from + Random::below(random.words(Draw::subset, 0, 0, static_cast<std::uint32_t>(k))[0], to - from);
    }
    const std::uint32_t i = points.finite_index(at);
    coded[k] = {morton(points, i), i};
  }
  std::sort(coded.begin(), coded.end());
  index_.reserve(kept);
  rows_.reserve(kept * static_cast<std::size_t>(dimension_));
  for (const auto& [code, i] : coded) {
    index_.push_back(i);
    for (int d = 0; d < dimension_; ++d) rows_.push_back(points.view().at(i, d));
  }
}

kernels::PointsView Subset::view() const noexcept {
  return {rows_.data(), kernels::Scalar::float64, dimension_, index_.size(), sizeof(double) * static_cast<std::size_t>(dimension_)};
}

void Subset::gather(std::span<const float> all, std::vector<float>& values) const {
  values.resize(index_.size());
  for (std::size_t k = 0; k < index_.size(); ++k) values[k] = all[index_[k]];
}

}  // namespace swarmfit::swarm
