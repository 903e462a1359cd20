#include "kernels/vulkan/cloud.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace swarmfit::kernels::vulkan {
namespace {

/// Most points of a segment: its columns are one binding, its chunks one row of groups.
std::size_t segment_limit(const DeviceTraits& device, const ChunkShape& shape, int dimension) {
  const std::size_t bytes = std::min(device.storage_range, device.allocation_limit);
  const std::size_t points = std::min<std::size_t>(bytes / (sizeof(float) * static_cast<std::size_t>(dimension)), 0xFFFFFFF0U);
  return std::min<std::size_t>(points / shape.points(), device.grid_limit[0]) * shape.points();
}

}  // namespace

Result<> Cloud::set(const PointsView& points, Extent extent) {
  const ChunkShape shape = chunk_shape(device_.traits(), extent.finite_count, points.dimension);
  const std::size_t limit = segment_limit(device_.traits(), shape, points.dimension);
  if (limit == 0) {
    return fail(Failure::Kind::invalid, fmt::format("the device's storage range is {} bytes, must be >= {}", device_.traits().storage_range,
                                                    shape.points() * sizeof(float) * static_cast<std::size_t>(points.dimension)));
  }
  points_.set(points, std::move(extent), shape);
  segments_.resize((points_.count() + limit - 1) / limit);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    Segment& segment = segments_[s];
    segment.first = s * limit;
    segment.count = static_cast<std::uint32_t>(std::min(limit, points_.count() - segment.first));
    segment.chunks = (segment.count + shape.points() - 1) / shape.points();
    segment.stride = segment.chunks * shape.points();
    segment.sums = segment.chunks * shape.sums;
    segment.points.reserve(device_, sizeof(float) * static_cast<std::size_t>(points.dimension) * segment.stride, Residence::device);
    segment.caps.reserve(device_, sizeof(float) * segment.stride, Residence::device);
    write_columns(segment);
    write(segment.caps, segment.stride, [](std::span<float> out) { std::fill(out.begin(), out.end(), 0.0F); });
  }
  return {};
}

void Cloud::write_columns(Segment& segment) {
  const auto width = static_cast<std::size_t>(points_.dimension());
  write(segment.points, width * segment.stride, [&](std::span<float> out) {
    for (std::size_t c = 0; c < width; ++c) {
      const auto column = out.subspan(c * segment.stride, segment.stride);
      const std::span<const float> own = points_.column(c).subspan(segment.first, segment.count);
      std::fill(std::copy(own.begin(), own.end(), column.begin()), column.end(), 0.0F);
    }
  });
  if (!bounded()) return;
  ChunkBounds::Columns columns;
  for (std::size_t c = 0; c < width; ++c) columns[c] = points_.column(c).subspan(segment.first, segment.count);
  segment.known.set_points(shape(), columns, points_.dimension());
  segment.bounds.reserve(device_, segment.known.values().size_bytes(), Residence::device);
  write_bounds(segment);
}

void Cloud::write_bounds(Segment& segment) {
  const std::span<const float> values = segment.known.values();
  write(segment.bounds, values.size(), [&](std::span<float> out) { std::copy(values.begin(), values.end(), out.begin()); });
}

void Cloud::write_caps(std::span<const float> values) {
  for (Segment& segment : segments_) {
    const std::span<const float> caps = write_values(segment, segment.caps, values);
    if (!bounded()) continue;
    segment.known.set_caps(caps);
    write_bounds(segment);
  }
}

void Cloud::write_tolerance(std::span<const float> values) {
  for (Segment& segment : segments_) {
    segment.tolerance.reserve(device_, sizeof(float) * segment.stride, Residence::device);
    write_values(segment, segment.tolerance, values);
  }
}

std::span<const float> Cloud::write_values(Segment& segment, Buffer& buffer, std::span<const float> values) {
  scratch_.resize(segment.count);
  for (std::size_t i = 0; i < segment.count; ++i) scratch_[i] = values[row(segment.first + i)];
  write(buffer, segment.stride,
        [&](std::span<float> out) { std::fill(std::copy(scratch_.begin(), scratch_.end(), out.begin()), out.end(), 0.0F); });
  return scratch_;
}

template <class Fill>
void Cloud::write(Buffer& buffer, std::size_t floats, Fill&& fill) {
  if (buffer.mapped()) return fill(buffer.as<float>().first(floats));
  staging_.reserve(device_, floats * sizeof(float), Residence::upload);
  fill(staging_.as<float>().first(floats));
  device_.copy(staging_.handle(), buffer.handle(), floats * sizeof(float));
}

}  // namespace swarmfit::kernels::vulkan
