// The inner loop of the colour cost, one for each instruction set the build knows (colour_kernels.cpp).
#pragma once

#include <cstddef>
#include <vector>

#include "kernels/colour_costs.hpp"

namespace swarmfit::kernels::cpu {

struct ColourKernels {
  const char* name;
  /// costs[i] for every colour; 1 <= neighbours <= the sample's size and kMostNeighbours.
  void (*costs)(const ColoursView& sample, std::size_t neighbours, const ColoursView& colours, float* costs);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const ColourKernels*>& available_colour_kernels();

}  // namespace swarmfit::kernels::cpu
