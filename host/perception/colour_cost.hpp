// How unlike a colour is to a sample of colours: the colour cost of the graph cut.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmfit::perception {

/// Hue (circular), lightness and saturation, all in [0, 1].
struct Hls {
  float h, l, s;
};

Hls to_hls(std::uint8_t red, std::uint8_t green, std::uint8_t blue);

/// Distance of hues on their circle. A quarter of the circle apart is as different as hues get: normalised by it, truncated at 1.
inline float hue_distance(float a, float b) {
  const float around = 0.5f - std::abs(0.5f - std::abs(a - b));  // min(|a - b|, 1 - |a - b|), with no branch
  return 0.5f * (4 * around + 1 - std::abs(4 * around - 1));     // min(4 around, 1)
}

/// Eqs. (6), (7). In [0, 1].
inline float colour_distance(const Hls& a, const Hls& b) {
  const float ds = std::abs(a.s - b.s), mean_s = 0.5f * (a.s + b.s);
  const float dhl = mean_s * hue_distance(a.h, b.h) + (1 - mean_s) * std::abs(a.l - b.l);  // Eq. (7)
  return ds * ds + (1 - ds) * dhl;                                                         // Eq. (6)
}

/// K of the colour cost, from the sample's size: half its square root.
int neighbours_for(std::size_t sample_size);

/// The colours of a label's sample. The cost of a colour is its mean distance to the K nearest of them.
class ColourSample {
 public:
  /// `neighbours`: K, or 0 to take it from the size. Costs are remembered by the `bits` leading bits of each channel, in [1, 8].
  explicit ColourSample(int neighbours = 0, int bits = 5) : neighbours_(neighbours), bits_(bits) {}

  void add(std::uint8_t red, std::uint8_t green, std::uint8_t blue);
  /// Call once after the last add. At most `largest` colours are kept, evenly spread over the order of adding.
  void close(std::size_t largest);

  bool empty() const noexcept { return hue_.empty(); }
  std::size_t size() const noexcept { return hue_.size(); }
  int neighbours() const noexcept { return neighbours_; }

  /// In [0, 1]; 1 for an empty sample.
  float cost(std::uint8_t red, std::uint8_t green, std::uint8_t blue);
  /// The same without memory.
  float cost(const Hls& colour);

 private:
  int neighbours_, bits_;
  std::vector<float> hue_, lightness_, saturation_;  // side by side, so that the distances are one plain loop
  std::vector<float> distances_, nearest_;
  std::vector<std::uint16_t> remembered_;  // in steps of 1 / 65534; 65535: not yet known
};

}  // namespace swarmfit::perception
