// What is known of a cloud's chunks before a point of them is looked at, as shaders/bounds.glsl reads it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/models/models.hpp"
#include "kernels/vulkan/tile_shape.hpp"

namespace swarmfit::kernels::vulkan {

/// Of the chunks of one segment: a ball and a box that hold the points, their caps' largest and sums, and the partial sums that cost.comp
/// would leave of a model that explains nothing.
class ChunkBounds {
 public:
  using Columns = std::array<std::span<const float>, kMaxDimension>;

  /// `columns`: of the segment's points, without padding; those beyond the dimension, 2 or 3, are empty.
  void set_points(const ChunkShape& shape, const Columns& columns, int dimension);
  /// One a point.
  void set_caps(std::span<const float> caps);

  /// Floats from one column to the next.
  std::uint32_t stride() const noexcept { return stride_; }
  std::span<const float> values() const noexcept { return values_; }

 private:
  void bound(const Columns& columns, int dimension, std::size_t chunk);
  void add_up(std::size_t chunk, std::span<const float> caps);
  float& at(std::size_t column, std::size_t chunk) { return values_[column * stride_ + chunk]; }

  ChunkShape shape_;
  std::size_t count_ = 0, chunks_ = 0;
  std::uint32_t stride_ = 0;
  std::vector<float> values_;
  std::vector<float> padded_, lanes_;
};

}  // namespace swarmfit::kernels::vulkan
