#include "kernels/vulkan/stored_points.hpp"

#include <algorithm>
#include <cmath>

namespace swarmfit::kernels::vulkan {
namespace {

/// A centred coordinate as float. What float cannot hold is as good as infinitely far, but a residual must not become inf - inf.
float centred(double value, double centre) {
  constexpr double kFar = 1e30;
  return static_cast<float>(std::clamp(value - centre, -kFar, kFar));
}

}  // namespace

void StoredPoints::set(const PointsView& points, Extent extent, const ChunkShape& shape) {
  extent_ = std::move(extent);
  shape_ = shape;
  dimension_ = points.dimension;
  rows_.clear();
  if (count() < points.count) {
    rows_.reserve(count());
    for (std::size_t i = 0; i < points.count; ++i) {
      if (extent_.finite[i]) rows_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  bounded_ = sorted_ && dimension_ <= 3 && count() > shape_.points();
  read(points);
  if (bounded_ && !points.ordered) sort();
}

void StoredPoints::read(const PointsView& points) {
  reach_ = {};
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) {
    columns_[c].resize(count());
    for (std::size_t i = 0; i < count(); ++i) {
      const float x = columns_[c][i] = centred(points.at(row(i), static_cast<int>(c)), extent_.centre[c]);
      reach_[c] = std::max(reach_[c], std::abs(x));
    }
  }
}

void StoredPoints::sort() {
  const auto width = static_cast<std::size_t>(dimension_);
  std::array<const float*, kMaxDimension> columns{};
  for (std::size_t c = 0; c < width; ++c) columns[c] = columns_[c].data();
  std::vector<std::uint32_t> order;
  morton_.sort(std::span(columns).first(width), count(), order);
  for (std::size_t c = 0; c < width; ++c) {
    scratch_.resize(order.size());
    std::transform(order.begin(), order.end(), scratch_.begin(), [&](std::uint32_t i) { return columns_[c][i]; });
    columns_[c].swap(scratch_);
  }
  std::transform(order.begin(), order.end(), order.begin(), [&](std::uint32_t i) { return static_cast<std::uint32_t>(row(i)); });
  rows_ = std::move(order);
}

}  // namespace swarmfit::kernels::vulkan
