#include "kernels/vulkan/cloud.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace swarmfit::kernels::vulkan {
namespace {

/// A centred coordinate as float. What float cannot hold is as good as infinitely far, but a residual must not become inf - inf.
float centred(double value, double centre) {
  constexpr double kFar = 1e30;
  return static_cast<float>(std::clamp(value - centre, -kFar, kFar));
}

/// Most points of a segment: its columns are one binding, its chunks one row of groups.
std::size_t segment_limit(const DeviceTraits& device, const ChunkShape& shape, int dimension) {
  const std::size_t bytes = std::min(device.storage_range, device.allocation_limit);
  const std::size_t points = std::min<std::size_t>(bytes / (sizeof(float) * static_cast<std::size_t>(dimension)), 0xFFFFFFF0U);
  return std::min<std::size_t>(points / shape.points(), device.grid_limit[0]) * shape.points();
}

}  // namespace

Result<> Cloud::set(const PointsView& points, Extent extent) {
  extent_ = std::move(extent);
  shape_ = chunk_shape(device_.traits(), extent_.finite_count, points.dimension);
  const std::size_t limit = segment_limit(device_.traits(), shape_, points.dimension);
  if (limit == 0) {
    return fail(Failure::Kind::invalid, fmt::format("the device's storage range is {} bytes, must be >= {}", device_.traits().storage_range,
                                                    shape_.points() * sizeof(float) * static_cast<std::size_t>(points.dimension)));
  }
  rows_.clear();
  if (extent_.finite_count < points.count) {
    rows_.reserve(extent_.finite_count);
    for (std::size_t i = 0; i < points.count; ++i) {
      if (extent_.finite[i]) rows_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  segments_.resize((extent_.finite_count + limit - 1) / limit);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    Segment& segment = segments_[s];
    segment.first = s * limit;
    segment.count = static_cast<std::uint32_t>(std::min(limit, extent_.finite_count - segment.first));
    segment.chunks = (segment.count + shape_.points() - 1) / shape_.points();
    segment.stride = segment.chunks * shape_.points();
    segment.sums = segment.chunks * shape_.sums;
    segment.points.reserve(device_, sizeof(float) * static_cast<std::size_t>(points.dimension) * segment.stride, Residence::device);
    segment.caps.reserve(device_, sizeof(float) * segment.stride, Residence::device);
    write_columns(segment, points);
    write(segment.caps, segment.stride, [](std::span<float> out) { std::fill(out.begin(), out.end(), 0.0F); });
  }
  return {};
}

void Cloud::write_columns(Segment& segment, const PointsView& points) {
  const auto columns = static_cast<std::size_t>(points.dimension);
  write(segment.points, columns * segment.stride, [&](std::span<float> out) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::span<float> column = out.subspan(c * segment.stride, segment.stride);
      for (std::size_t i = 0; i < segment.count; ++i) {
        column[i] = centred(points.at(row(segment.first + i), static_cast<int>(c)), extent_.centre[c]);
      }
      std::fill(column.begin() + segment.count, column.end(), 0.0F);
    }
  });
}

void Cloud::write_caps(std::span<const float> values) {
  for (Segment& segment : segments_) write_values(segment, segment.caps, values);
}

void Cloud::write_tolerance(std::span<const float> values) {
  for (Segment& segment : segments_) {
    segment.tolerance.reserve(device_, sizeof(float) * segment.stride, Residence::device);
    write_values(segment, segment.tolerance, values);
  }
}

void Cloud::write_values(Segment& segment, Buffer& buffer, std::span<const float> values) {
  write(buffer, segment.stride, [&](std::span<float> out) {
    for (std::size_t i = 0; i < segment.count; ++i) out[i] = values[row(segment.first + i)];
    std::fill(out.begin() + segment.count, out.end(), 0.0F);
  });
}

template <class Fill>
void Cloud::write(Buffer& buffer, std::size_t floats, Fill&& fill) {
  if (buffer.mapped()) return fill(buffer.as<float>().first(floats));
  staging_.reserve(device_, floats * sizeof(float), Residence::upload);
  fill(staging_.as<float>().first(floats));
  device_.copy(staging_.handle(), buffer.handle(), floats * sizeof(float));
}

}  // namespace swarmfit::kernels::vulkan
