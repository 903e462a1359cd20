#include "host/swarm/subset.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
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

std::vector<std::uint32_t> in_morton_order(const models::WorkingPoints& points, std::span<const std::uint32_t> part) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> coded;
  coded.reserve(part.size());
  for (const std::uint32_t i : part) coded.emplace_back(morton(points, i), i);
  std::sort(coded.begin(), coded.end());
  std::vector<std::uint32_t> index(coded.size());
  std::transform(coded.begin(), coded.end(), index.begin(), [](const auto& one) { return one.second; });
  return index;
}

}  // namespace

std::vector<std::uint32_t> draw_part(const models::WorkingPoints& points, const Random& random, std::uint32_t number, std::size_t size) {
  const std::size_t n = points.finite_count();
  std::vector<std::size_t> places(std::min(n, size));
  std::iota(places.begin(), places.end(), std::size_t{0});
  std::array<std::uint32_t, 4> words{};
  for (std::size_t k = 0; k < places.size() && places.size() < n; ++k) {
    if (k % 4 == 0) words = random.words(Draw::subset, number, 0, static_cast<std::uint32_t>(k / 4));
    const std::size_t from = n * k / places.size(), to = n * (k + 1) / places.size();
    places[k] = from + Random::below(words[k % 4], to - from);
  }
  return points.finite_at(places);
}

Rows::Rows(const kernels::PointsView& points, std::span<const std::uint32_t> index)
    : scalar_(points.scalar == kernels::Scalar::float32 ? PointsView::Scalar::float32 : PointsView::Scalar::float64),
      dimension_(points.dimension),
      width_(static_cast<std::size_t>(points.dimension) * (points.scalar == kernels::Scalar::float32 ? sizeof(float) : sizeof(double))),
      bytes_(index.size() * width_) {
  for (std::size_t k = 0; k < index.size(); ++k) {
    std::memcpy(bytes_.data() + k * width_, static_cast<const std::byte*>(points.data) + index[k] * points.stride, width_);
  }
}

PointsView Rows::view() const noexcept { return {bytes_.data(), scalar_, dimension_, bytes_.size() / width_, width_}; }

Subset::Subset(const models::WorkingPoints& points, const Random& random, std::size_t size)
    : index_(in_morton_order(points, draw_part(points, random, kSearchedPart, size))), rows_(points.view(), index_) {}

void Subset::gather(std::span<const float> all, std::vector<float>& values) const {
  values.resize(index_.size());
  for (std::size_t k = 0; k < index_.size(); ++k) values[k] = all[index_[k]];
}

Part look_closely(models::WorkingPoints& points, const models::ModelSpace& space, const Random& random, std::size_t size) {
  constexpr std::size_t kNeighbours = 16;
  Part part{Subset(points, random, size), {}};
  const bool correspondences = points.dimension() > 3;
  if (correspondences || space.needs_normals()) part.neighbours = models::Neighbours(points, part.points.index(), kNeighbours);
  if (space.needs_normals()) {
    std::vector<Eigen::Vector3f> normals;
    models::estimate_normals(points, part.points.index(), part.neighbours, normals);
    points.set_normals(std::move(normals));
  }
  return part;
}

}  // namespace swarmfit::swarm
