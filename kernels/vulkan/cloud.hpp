// The points on the device, in segments no larger than a binding may be.
#pragma once

#include <vector>

#include "kernels/vulkan/buffer.hpp"
#include "kernels/vulkan/chunk_bounds.hpp"
#include "kernels/vulkan/stored_points.hpp"

namespace swarmfit::kernels::vulkan {

struct Segment {
  std::size_t first = 0;     ///< of the finite points
  std::uint32_t count = 0;   ///< finite points
  std::uint32_t stride = 0;  ///< points in a column: count, padded to whole chunks with points of cap 0
  std::uint32_t chunks = 0;
  std::uint32_t sums = 0;  ///< partial sums of a particle
  Buffer points;
  Buffer caps;
  Buffer partials;  ///< [particle][partial sum]
  ChunkBounds known;
  Buffer bounds;     ///< what is known, on the device
  Buffer tolerance;  ///< like caps; made when assign first needs it
  Buffer output;     ///< distances or labels; made when first needed
};

class Cloud {
 public:
  /// `sorted`: as StoredPoints has it; then chunks are bounded.
  Cloud(const Device& device, bool sorted) : device_(device), points_(sorted) {}

  /// Copies the points, and sets all caps to 0. Buffers that are large enough are kept. Throws std::exception.
  /// Fails with `invalid` where a single chunk does not fit the device's storage range.
  Result<> set(const PointsView& points, Extent extent);
  /// `values` in input order.
  void write_caps(std::span<const float> values);
  void write_tolerance(std::span<const float> values);

  const Extent& extent() const noexcept { return points_.extent(); }
  /// Are there bounds of chunks?
  bool bounded() const noexcept { return points_.bounded(); }
  /// Largest |coordinate| about the centre, a column.
  const std::array<float, kMaxDimension>& reach() const noexcept { return points_.reach(); }
  const ChunkShape& shape() const noexcept { return points_.shape(); }
  std::vector<Segment>& segments() noexcept { return segments_; }
  /// The row in the input of a finite point.
  std::size_t row(std::size_t finite_point) const noexcept { return points_.row(finite_point); }

 private:
  template <class Fill>
  void write(Buffer& buffer, std::size_t floats, Fill&& fill);
  /// Returns what was written, in the segment's order and without padding; until the next call.
  std::span<const float> write_values(Segment& segment, Buffer& buffer, std::span<const float> values);
  void write_columns(Segment& segment);
  void write_bounds(Segment& segment);

  const Device& device_;
  StoredPoints points_;
  std::vector<float> scratch_;
  std::vector<Segment> segments_;
  Buffer staging_;
};

}  // namespace swarmfit::kernels::vulkan
