// Colours that tell planes and objects apart.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace swarmfit::io {

using Rgb = std::array<std::uint8_t, 3>;

inline constexpr Rgb kStickingOut = {255, 221, 0};  ///< yellow, which no plane has
inline constexpr Rgb kUnlabelled = {128, 128, 128};

/// Of the k-th plane, k >= 1; neighbours in number are far apart in hue.
inline Rgb plane_colour(std::size_t k) noexcept {
  constexpr std::array<Rgb, 10> kColours = {{{230, 57, 70},
                                             {42, 111, 219},
                                             {46, 164, 79},
                                             {155, 81, 224},
                                             {0, 172, 193},
                                             {214, 51, 132},
                                             {139, 90, 43},
                                             {94, 96, 206},
                                             {0, 128, 96},
                                             {200, 80, 192}}};
  return kColours[(k - 1) % kColours.size()];
}

}  // namespace swarmfit::io
