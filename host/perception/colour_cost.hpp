// How unlike a colour is to a sample of colours: the colour cost of the graph cut.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "kernels/colour_costs.hpp"

namespace swarmfit::perception {

/// Hue (circular), lightness and saturation, all in [0, 1].
struct Hls {
  float h, l, s;
};

Hls to_hls(std::uint8_t red, std::uint8_t green, std::uint8_t blue);

/// Eqs. (6), (7). In [0, 1].
inline float colour_distance(const Hls& a, const Hls& b) { return kernels::colour_distance(a.h, a.l, a.s, b.h, b.l, b.s); }

/// K of the colour cost, from the sample's size: half its square root.
int neighbours_for(std::size_t sample_size);

/// Colour costs by a back end, asked for by several threads. Of its failures the first is kept, and nothing is asked from then on.
class ColourWork {
 public:
  explicit ColourWork(const kernels::ColourCosts& costs) : costs_(costs) {}
  /// False where it failed, now or before.
  bool evaluate(const kernels::ColoursView& sample, int neighbours, const kernels::ColoursView& colours, std::span<float> costs);
  const std::optional<kernels::Failure>& failure() const noexcept { return failure_; }

 private:
  const kernels::ColourCosts& costs_;
  std::mutex mutex_;
  std::optional<kernels::Failure> failure_;
};

/// The colours of a label's sample. The cost of a colour is its mean distance to the K nearest of them.
class ColourSample {
 public:
  /// `neighbours`: K, or 0 to take it from the size. Costs are remembered by the `bits` leading bits of each channel, in [1, 8].
  explicit ColourSample(int neighbours = 0, int bits = 5) : neighbours_(neighbours), bits_(bits) {}

  void add(std::uint8_t red, std::uint8_t green, std::uint8_t blue);
  /// Call once after the last add. At most `largest` colours are kept, evenly spread over the order of adding.
  void close(std::size_t largest);

  /// A colour whose cost will be asked for. After close.
  void want(std::uint8_t red, std::uint8_t green, std::uint8_t blue);
  /// All that is wanted, in one go; without it, or with null, each cost is worked out when it is asked for.
  void settle(ColourWork* work);

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
  std::size_t key(std::uint8_t red, std::uint8_t green, std::uint8_t blue) const;
  Hls colour_of(std::size_t key) const;

  std::vector<std::uint16_t> remembered_;  // by key, in steps of 1 / kWhole
  std::vector<std::uint32_t> wanted_;      // keys
};

}  // namespace swarmfit::perception
