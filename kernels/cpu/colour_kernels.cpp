// The colour cost on vectors: a lane for each colour, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // as in cpu_kernels.cpp
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/colour_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "kernels/colour_costs.hpp"
#include "kernels/cpu/colour_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

/// Eqs. (6), (7).
HWY_INLINE V distance(D d, V hue_a, V light_a, V sat_a, V hue_b, V light_b, V sat_b) {
  const V half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f);
  const V around = half - hn::Abs(half - hn::Abs(hue_a - hue_b));
  const V dh = hn::Min(hn::Set(d, 4.0f) * around, one);
  const V ds = hn::Abs(sat_a - sat_b), mean_s = half * (sat_a + sat_b);
  const V dhl = hn::MulAdd(mean_s, dh, (one - mean_s) * hn::Abs(light_a - light_b));
  return hn::MulAdd(ds, ds, (one - ds) * dhl);
}

/// The colours of one vector. `nearest`: room for `neighbours` vectors, ascending in each lane.
HWY_INLINE V mean_to_nearest(D d, const ColoursView& sample, std::size_t neighbours, V hue, V light, V sat, float* HWY_RESTRICT nearest) {
  const std::size_t lanes = hn::Lanes(d);
  const V far = hn::Set(d, 2.0f);  // no two colours are so far apart
  for (std::size_t k = 0; k < neighbours; ++k) hn::Store(far, d, nearest + k * lanes);
  V last = far;
  for (std::size_t j = 0; j < sample.size(); ++j) {
    V far_one = distance(d, hue, light, sat, hn::Set(d, sample.hue[j]), hn::Set(d, sample.lightness[j]), hn::Set(d, sample.saturation[j]));
    if (hn::AllFalse(d, far_one < last)) continue;
    // It sinks to its place; what it pushes out falls off the end.
    for (std::size_t k = 0; k < neighbours; ++k) {
      const V held = hn::Load(d, nearest + k * lanes);
      hn::Store(hn::Min(held, far_one), d, nearest + k * lanes);
      far_one = hn::Max(held, far_one);
    }
    last = hn::Load(d, nearest + (neighbours - 1) * lanes);
  }
  V sum = hn::Zero(d);
  for (std::size_t k = 0; k < neighbours; ++k) sum = sum + hn::Load(d, nearest + k * lanes);
  return sum / hn::Set(d, static_cast<float>(neighbours));
}

void colour_costs(const ColoursView& sample, std::size_t neighbours, const ColoursView& colours, float* costs) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN float nearest[static_cast<std::size_t>(kMostNeighbours) * hn::MaxLanes(d)];
  for (std::size_t i = 0; i < colours.size(); i += lanes) {
    const std::size_t count = std::min(lanes, colours.size() - i);
    HWY_ALIGN float tail[3 * hn::MaxLanes(d)] = {};
    const float* const columns[3] = {colours.hue.data() + i, colours.lightness.data() + i, colours.saturation.data() + i};
    for (std::size_t c = 0; c < 3; ++c) std::memcpy(tail + c * lanes, columns[c], count * sizeof(float));
    const V mean =
        mean_to_nearest(d, sample, neighbours, hn::Load(d, tail), hn::Load(d, tail + lanes), hn::Load(d, tail + 2 * lanes), nearest);
    HWY_ALIGN float out[hn::MaxLanes(d)];
    hn::Store(mean, d, out);
    std::memcpy(costs + i, out, count * sizeof(float));
  }
}

const ColourKernels& colour_kernels() {
  static const ColourKernels table{hwy::TargetName(HWY_TARGET), colour_costs};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels::cpu {

HWY_EXPORT(colour_kernels);

const std::vector<const ColourKernels*>& available_colour_kernels() {
  static const std::vector<const ColourKernels*> all = runnable(HWY_DISPATCH_TABLE(colour_kernels));
  return all;
}

}  // namespace swarmfit::kernels::cpu
#endif  // HWY_ONCE
