// Columns of numbers of any type in memory, gathered into a cloud.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <swarmfit/cloud.hpp>

namespace swarmfit::io {

enum class Scalar { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

constexpr std::size_t size_of(Scalar type) noexcept {
  switch (type) {
    case Scalar::i8:
    case Scalar::u8: return 1;
    case Scalar::i16:
    case Scalar::u16: return 2;
    case Scalar::i32:
    case Scalar::u32:
    case Scalar::f32: return 4;
    default: return 8;
  }
}

/// One number a point: the i-th starts at first + i * stride bytes.
struct Column {
  const char* first = nullptr;
  std::size_t stride = 0;
  Scalar type = Scalar::f32;
  bool swapped = false;  ///< the bytes' order is not this machine's
};

/// Where a point's colour comes from: three channels, or one column whose bits are 0x..RRGGBB.
struct ColourColumns {
  std::optional<Column> packed;
  Column red, green, blue;
};

/// x, y, z into values32 where all three are 32-bit floats, else into values64; colours into rgb.
void gather(std::span<const Column, 3> xyz, const std::optional<ColourColumns>& colour, std::size_t count, Cloud& cloud);

/// A colour channel as files give it: 8 bits as they are, 16 bits by their upper half, floats in [0, 1].
std::uint8_t channel(double value, Scalar type) noexcept;

inline void unpack_rgb(std::uint32_t bits, std::uint8_t* rgb) noexcept {
  rgb[0] = static_cast<std::uint8_t>(bits >> 16);
  rgb[1] = static_cast<std::uint8_t>(bits >> 8);
  rgb[2] = static_cast<std::uint8_t>(bits);
}

}  // namespace swarmfit::io
