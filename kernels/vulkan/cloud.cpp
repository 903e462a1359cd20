#include "kernels/vulkan/cloud.hpp"

#include <algorithm>
#include <cmath>

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
  bounded_ = sorted_ && points.dimension <= 3 && extent_.finite_count > shape_.points();
  read_columns(points);
  if (bounded_ && !points.ordered) sort();
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
    write_columns(segment);
    write(segment.caps, segment.stride, [](std::span<float> out) { std::fill(out.begin(), out.end(), 0.0F); });
  }
  return {};
}

void Cloud::read_columns(const PointsView& points) {
  dimension_ = points.dimension;
  reach_ = {};
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) {
    columns_[c].resize(extent_.finite_count);
    for (std::size_t i = 0; i < extent_.finite_count; ++i) {
      const float x = columns_[c][i] = centred(points.at(row(i), static_cast<int>(c)), extent_.centre[c]);
      reach_[c] = std::max(reach_[c], std::abs(x));
    }
  }
}

void Cloud::sort() {
  const auto width = static_cast<std::size_t>(dimension_);
  std::array<const float*, kMaxDimension> columns{};
  for (std::size_t c = 0; c < width; ++c) columns[c] = columns_[c].data();
  std::vector<std::uint32_t> order;
  morton_.sort(std::span(columns).first(width), extent_.finite_count, order);
  for (std::size_t c = 0; c < width; ++c) {
    scratch_.resize(order.size());
    std::transform(order.begin(), order.end(), scratch_.begin(), [&](std::uint32_t i) { return columns_[c][i]; });
    columns_[c].swap(scratch_);
  }
  std::transform(order.begin(), order.end(), order.begin(), [&](std::uint32_t i) { return static_cast<std::uint32_t>(row(i)); });
  rows_ = std::move(order);
}

void Cloud::write_columns(Segment& segment) {
  const auto width = static_cast<std::size_t>(dimension_);
  write(segment.points, width * segment.stride, [&](std::span<float> out) {
    for (std::size_t c = 0; c < width; ++c) {
      const auto column = out.subspan(c * segment.stride, segment.stride);
      const auto first = columns_[c].begin() + static_cast<std::ptrdiff_t>(segment.first);
      std::fill(std::copy(first, first + segment.count, column.begin()), column.end(), 0.0F);
    }
  });
  if (!bounded_) return;
  ChunkBounds::Columns columns;
  for (std::size_t c = 0; c < width; ++c) columns[c] = std::span(columns_[c]).subspan(segment.first, segment.count);
  segment.known.set_points(shape_, columns, dimension_);
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
    if (!bounded_) continue;
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
