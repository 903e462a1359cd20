#include "host/io/columns.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace swarmfit::io {
namespace {

/// Points a block: a block's bytes stay in the cache while column after column is taken from it.
constexpr std::size_t kBlock = 2048;

template <class T>
T load(const char* from, bool swapped) noexcept {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (swapped) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Calls `sink(i, value)` for points begin..end, the type chosen once.
template <class T, class Sink>
void walk(const Column& column, std::size_t begin, std::size_t end, const Sink& sink) {
  const char* from = column.first + begin * column.stride;
  if (column.swapped) {
    for (std::size_t i = begin; i < end; ++i, from += column.stride) sink(i, load<T>(from, true));
  } else {
    for (std::size_t i = begin; i < end; ++i, from += column.stride) sink(i, load<T>(from, false));
  }
}

template <class Sink>
void walk_any(const Column& column, std::size_t begin, std::size_t end, const Sink& sink) {
  switch (column.type) {
    case Scalar::i8: return walk<std::int8_t>(column, begin, end, sink);
    case Scalar::u8: return walk<std::uint8_t>(column, begin, end, sink);
    case Scalar::i16: return walk<std::int16_t>(column, begin, end, sink);
    case Scalar::u16: return walk<std::uint16_t>(column, begin, end, sink);
    case Scalar::i32: return walk<std::int32_t>(column, begin, end, sink);
    case Scalar::u32: return walk<std::uint32_t>(column, begin, end, sink);
    case Scalar::i64: return walk<std::int64_t>(column, begin, end, sink);
    case Scalar::u64: return walk<std::uint64_t>(column, begin, end, sink);
    case Scalar::f32: return walk<float>(column, begin, end, sink);
    case Scalar::f64: return walk<double>(column, begin, end, sink);
  }
}

void gather_colour(const ColourColumns& colour, std::size_t begin, std::size_t end, std::uint8_t* rgb) {
  if (colour.packed) {
    // Its type does not matter: a float's bits are a colour too.
    walk<std::uint32_t>(*colour.packed, begin, end, [rgb](std::size_t i, std::uint32_t bits) { unpack_rgb(bits, rgb + 3 * i); });
    return;
  }
  const Column* channels[] = {&colour.red, &colour.green, &colour.blue};
  for (std::size_t c = 0; c < 3; ++c) {
    const Scalar type = channels[c]->type;
    if (type == Scalar::u8) {
      walk<std::uint8_t>(*channels[c], begin, end, [=](std::size_t i, std::uint8_t value) { rgb[3 * i + c] = value; });
    } else {
      walk_any(*channels[c], begin, end, [=](std::size_t i, auto value) { rgb[3 * i + c] = channel(static_cast<double>(value), type); });
    }
  }
}

}  // namespace

std::uint8_t channel(double value, Scalar type) noexcept {
  if (type == Scalar::f32 || type == Scalar::f64) value *= 255;
  if (type == Scalar::u16) value = std::floor(value / 256);
  return static_cast<std::uint8_t>(std::clamp(std::isnan(value) ? 0.0 : std::round(value), 0.0, 255.0));
}

void gather(std::span<const Column, 3> xyz, const std::optional<ColourColumns>& colour, std::size_t count, Cloud& cloud) {
  const bool all_float = std::all_of(xyz.begin(), xyz.end(), [](const Column& c) { return c.type == Scalar::f32 && !c.swapped; });
  const bool narrow = std::all_of(xyz.begin(), xyz.end(), [](const Column& c) { return c.type == Scalar::f32; });
  const bool adjacent = all_float && xyz[1].first == xyz[0].first + 4 && xyz[2].first == xyz[0].first + 8 &&
                        xyz[0].stride == xyz[1].stride && xyz[0].stride == xyz[2].stride;
  cloud.dimension = 3;
  if (narrow) {
    cloud.values32.resize(3 * count);
  } else {
    cloud.values64.resize(3 * count);
  }
  if (colour) cloud.rgb.resize(3 * count);
  float* narrow_out = cloud.values32.data();
  double* wide_out = cloud.values64.data();
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, count);
    if (adjacent) {
      const std::size_t stride = xyz[0].stride;
      for (std::size_t i = begin; i < end; ++i) std::memcpy(narrow_out + 3 * i, xyz[0].first + i * stride, 3 * sizeof(float));
    } else {
      for (std::size_t d = 0; d < 3; ++d) {
        if (narrow) {
          walk<float>(xyz[d], begin, end, [=](std::size_t i, float value) { narrow_out[3 * i + d] = value; });
        } else {
          walk_any(xyz[d], begin, end, [=](std::size_t i, auto value) { wide_out[3 * i + d] = static_cast<double>(value); });
        }
      }
    }
    if (colour) gather_colour(*colour, begin, end, cloud.rgb.data());
  }
}

}  // namespace swarmfit::io
