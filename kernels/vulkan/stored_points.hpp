// A cloud as a device holds it, prepared on the host: finite points only, centred, column after column.
#pragma once

#include <array>
#include <vector>

#include "kernels/checks.hpp"
#include "kernels/morton_order.hpp"
#include "kernels/vulkan/tile_shape.hpp"

namespace swarmfit::kernels::vulkan {

class StoredPoints {
 public:
  /// `sorted`: points of two or three columns that fill more than one chunk are put in Morton order, so that chunks are small in space.
  explicit StoredPoints(bool sorted) : sorted_(sorted) {}

  void set(const PointsView& points, Extent extent, const ChunkShape& shape);

  const Extent& extent() const noexcept { return extent_; }
  const ChunkShape& shape() const noexcept { return shape_; }
  int dimension() const noexcept { return dimension_; }
  std::size_t count() const noexcept { return extent_.finite_count; }
  /// Are chunks small in space, so that bounds of them tell something?
  bool bounded() const noexcept { return bounded_; }
  /// Largest |coordinate| about the centre, a column.
  const std::array<float, kMaxDimension>& reach() const noexcept { return reach_; }
  std::span<const float> column(std::size_t c) const noexcept { return columns_[c]; }
  /// The row in the input of a stored point.
  std::size_t row(std::size_t stored) const noexcept { return rows_.empty() ? stored : rows_[stored]; }

 private:
  void read(const PointsView& points);
  void sort();

  bool sorted_, bounded_ = false;
  int dimension_ = 0;
  Extent extent_;
  ChunkShape shape_;
  std::array<float, kMaxDimension> reach_{};
  std::array<std::vector<float>, kMaxDimension> columns_;
  std::vector<float> scratch_;
  std::vector<std::uint32_t> rows_;  // empty where it would be the identity
  MortonOrder morton_;
};

}  // namespace swarmfit::kernels::vulkan
