// What Morton codes interleave.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace swarmfit::kernels {

/// Every byte with `gap` zeros after each of its bits.
using SpreadBytes = std::array<std::uint32_t, 256>;
constexpr SpreadBytes spread_bytes(int gap) {
  SpreadBytes all{};
  for (std::uint32_t byte = 0; byte < all.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) all[byte] |= ((byte >> bit) & 1U) << (bit * (gap + 1));
  }
  return all;
}
inline constexpr std::array<SpreadBytes, 4> kSpreadBytes{spread_bytes(0), spread_bytes(1), spread_bytes(2), spread_bytes(3)};

/// The bits of a number with room between them for those of the other axes.
class BitSpread {
 public:
  /// 1 <= axes <= 4.
  explicit BitSpread(int axes) : axes_(axes), bytes_(kSpreadBytes[static_cast<std::size_t>(axes - 1)]) {}

  /// Of a number of at most 16 bits.
  std::uint64_t operator()(std::uint32_t v) const noexcept {
    const std::uint64_t low = bytes_[v & 255U], high = bytes_[v >> 8];
    return high << (8 * axes_) | low;
  }

 private:
  int axes_;
  const SpreadBytes& bytes_;
};

}  // namespace swarmfit::kernels
