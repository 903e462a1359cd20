// The seam of the colour cost: how unlike colours are to a sample of colours, on the back ends that the fitness runs on.
//
// The cost of a colour is its mean distance to the K nearest of the sample. With hue (circular), lightness and saturation in [0, 1],
//
//   D_HLS = D_S^2 + (1 - D_S) D_HL,   D_HL = s D_H + (1 - s) D_L          Eqs. (6), (7) of Zhou et al. 2010
//
// s the mean saturation of both, D_H a quarter of the circle at most, normalised by it.
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <string_view>

#include "kernels/evaluators.hpp"

namespace swarmfit::kernels {

/// Largest allowed |cost - reference cost|.
inline constexpr double kColourTolerance = 1e-5;

/// Largest K of any back end.
inline constexpr int kMostNeighbours = 64;

/// Colours component by component, all of one length, all values in [0, 1].
struct ColoursView {
  std::span<const float> hue, lightness, saturation;
  std::size_t size() const noexcept { return hue.size(); }
};

/// Distance of two hues, of 1 for a quarter of the circle and more.
template <class T>
T hue_distance(T a, T b) {
  const T around = T(0.5) - std::abs(T(0.5) - std::abs(a - b));  // min(|a - b|, 1 - |a - b|), with no branch
  return T(0.5) * (4 * around + 1 - std::abs(4 * around - 1));   // min(4 around, 1)
}

/// In [0, 1].
template <class T>
T colour_distance(T hue_a, T lightness_a, T saturation_a, T hue_b, T lightness_b, T saturation_b) {
  const T ds = std::abs(saturation_a - saturation_b), mean_s = T(0.5) * (saturation_a + saturation_b);
  const T dhl = mean_s * hue_distance(hue_a, hue_b) + (1 - mean_s) * std::abs(lightness_a - lightness_b);  // Eq. (7)
  return ds * ds + (1 - ds) * dhl;                                                                         // Eq. (6)
}

/// Several threads may call at once.
class ColourCosts {
 public:
  virtual ~ColourCosts() = default;
  ColourCosts() = default;
  ColourCosts(const ColourCosts&) = delete;
  ColourCosts& operator=(const ColourCosts&) = delete;

  virtual const Identity& identity() const noexcept = 0;

  /// costs[i] of the i-th of `colours`, in [0, 1]; 1 where the sample is empty. `neighbours` is K, in [1, kMostNeighbours]; the sample's
  /// size where that is less. costs.size() == colours.size(). Fails with `invalid` where sizes differ or K is out of its bounds.
  virtual Result<> evaluate(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<float> costs) const = 0;
};

/// The bounds of evaluate's arguments, checked alike by every back end.
Result<> check_colours(const ColoursView& sample, int neighbours, const ColoursView& colours, std::span<const float> costs);

/// On the back end and device of an evaluator, as its identity names them. `choose`: smaller workloads go to the processor's cores even
/// where that is a GPU, which takes longer to be asked than they take to do. Fails with `unavailable`.
Result<std::unique_ptr<ColourCosts>> make_colour_costs(const Identity& where, bool choose, const EvaluatorOptions& options);

// One factory a back end, each defined in its own folder.
std::unique_ptr<ColourCosts> make_reference_colour_costs();
/// `simd`: an instruction set by its name; empty takes the best.
Result<std::unique_ptr<ColourCosts>> make_cpu_colour_costs(std::string_view simd);
/// Instruction sets that this build knows and this processor can run, best first.
std::vector<std::string> colour_cost_targets();
Result<std::unique_ptr<ColourCosts>> make_vulkan_colour_costs(const EvaluatorOptions& options, std::string_view device);

}  // namespace swarmfit::kernels
