// ROS's sensor_msgs/PointCloud2. Any type of that shape will do, of ROS 1 or 2; no header of ROS's is needed here.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit::adapters {

template <class Message>
concept PointCloud2 = requires(const Message& m) {
  { m.width } -> std::convertible_to<std::size_t>;
  { m.height } -> std::convertible_to<std::size_t>;
  { m.point_step } -> std::convertible_to<std::size_t>;
  { m.row_step } -> std::convertible_to<std::size_t>;
  { m.is_bigendian } -> std::convertible_to<bool>;
  { m.data.size() } -> std::convertible_to<std::size_t>;
  { m.fields.begin()->name } -> std::convertible_to<std::string>;
  { m.fields.begin()->offset } -> std::convertible_to<std::size_t>;
  { m.fields.begin()->datatype } -> std::convertible_to<int>;
};

namespace point_cloud2 {

inline constexpr int kFloat32 = 7, kFloat64 = 8;  // of sensor_msgs/PointField

/// Where x, y and z lie in a point, and whether all of the cloud is there.
struct Layout {
  PointsView::Scalar scalar = PointsView::Scalar::float32;
  std::size_t offset = 0;
};

template <PointCloud2 Message>
auto find(const Message& message, std::string_view name) {
  auto field = message.fields.begin();
  while (field != message.fields.end() && field->name != name) ++field;
  return field;
}

template <PointCloud2 Message>
Expected<Layout> layout(const Message& message) {
  const auto complain = [](const std::string& what) { return fail(Error::Kind::bad_input, "the PointCloud2 " + what); };
  if (static_cast<bool>(message.is_bigendian) != (std::endian::native == std::endian::big)) {
    return complain("is of the other byte order, must be of this machine's");
  }
  const auto x = find(message, "x"), y = find(message, "y"), z = find(message, "z"), none = message.fields.end();
  if (x == none || y == none || z == none) return complain("lacks a field, must have x, y and z");
  if ((x->datatype != kFloat32 && x->datatype != kFloat64) || y->datatype != x->datatype || z->datatype != x->datatype) {
    return complain("has fields x, y, z of datatypes " + std::to_string(x->datatype) + ", " + std::to_string(y->datatype) + ", " +
                    std::to_string(z->datatype) + ", must be all FLOAT32 (7) or all FLOAT64 (8)");
  }
  const std::size_t size = x->datatype == kFloat32 ? sizeof(float) : sizeof(double), offset = x->offset;
  if (y->offset != offset + size || z->offset != offset + 2 * size) return complain("has x, y, z apart, must have them side by side");
  const std::size_t width = message.width, height = message.height, step = message.point_step, row = message.row_step;
  if (offset + 3 * size > step)
    return complain("has points of " + std::to_string(step) + " bytes, must hold x, y, z at " + std::to_string(offset));
  if (height > 1 && row < width * step) return complain("has row_step " + std::to_string(row) + ", must be >= width * point_step");
  const std::size_t needed = width == 0 || height == 0 ? 0 : (height - 1) * row + width * step;
  if (message.data.size() < needed) {
    return complain("holds " + std::to_string(message.data.size()) + " bytes, must hold >= " + std::to_string(needed));
  }
  return Layout{size == sizeof(float) ? PointsView::Scalar::float32 : PointsView::Scalar::float64, offset};
}

}  // namespace point_cloud2

/// The message's own memory. Fails with bad_input: fields x, y, z that are missing, apart or not floats, another byte order, too few bytes,
/// gaps between the rows of an organised cloud (copy that with to_cloud).
template <PointCloud2 Message>
Expected<PointsView> view(const Message& message) {
  const auto layout = point_cloud2::layout(message);
  if (!layout) return tl::unexpected(layout.error());
  const std::size_t width = message.width, height = message.height, step = message.point_step;
  if (height > 1 && message.row_step != width * step) {
    return fail(Error::Kind::bad_input, "the PointCloud2 has row_step " + std::to_string(message.row_step) +
                                            ", must be width * point_step to be looked at where it lies: use to_cloud");
  }
  return PointsView(message.data.data() + layout->offset, layout->scalar, 3, width * height, step);
}

/// A copy with grid and colours (field rgb or rgba), for a Perceiver. Fails with bad_input as view does, but for gaps.
template <PointCloud2 Message>
Expected<Cloud> to_cloud(const Message& message) {
  const auto layout = point_cloud2::layout(message);
  if (!layout) return tl::unexpected(layout.error());
  const std::size_t width = message.width, height = message.height;
  const bool single = layout->scalar == PointsView::Scalar::float32;
  Cloud cloud;
  cloud.width = static_cast<int>(width);
  cloud.height = static_cast<int>(height);
  if (single) {
    cloud.values32.resize(3 * width * height);
  } else {
    cloud.values64.resize(3 * width * height);
  }
  auto colour = point_cloud2::find(message, "rgb");
  if (colour == message.fields.end()) colour = point_cloud2::find(message, "rgba");
  const bool coloured = colour != message.fields.end() && colour->offset + 4 <= message.point_step;
  if (coloured) cloud.rgb.reserve(3 * width * height);
  const std::size_t bytes = 3 * (single ? sizeof(float) : sizeof(double));
  auto* to = single ? reinterpret_cast<unsigned char*>(cloud.values32.data()) : reinterpret_cast<unsigned char*>(cloud.values64.data());
  for (std::size_t v = 0; v < height; ++v) {
    const unsigned char* point = message.data.data() + v * message.row_step;
    for (std::size_t u = 0; u < width; ++u, point += message.point_step, to += bytes) {
      std::memcpy(to, point + layout->offset, bytes);
      if (!coloured) continue;
      std::uint32_t packed;  // 0x00rrggbb, whatever the field's type
      std::memcpy(&packed, point + colour->offset, sizeof packed);
      for (const int shift : {16, 8, 0}) cloud.rgb.push_back(static_cast<std::uint8_t>(packed >> shift));
    }
  }
  return cloud;
}

}  // namespace swarmfit::adapters
