// The inner loops of the tallies, one table of functions for each instruction set the build knows (tally_kernels.cpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/point_tallies.hpp"

namespace swarmfit::kernels::cpu {

struct TallyKernels {
  const char* name;
  void (*count_slabs)(const SlabsView& view, SlabCounts& counts);
  /// `marks` and `others` may be null.
  void (*sink)(std::span<const float> distances, const Sinking& how, std::uint8_t* marks, float* others, float* caps);
  double (*saved)(std::span<const float> caps, std::span<const float> distances);
  void (*bend)(std::span<float> distances, const Bending& how);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const TallyKernels*>& available_tally_kernels();

}  // namespace swarmfit::kernels::cpu
