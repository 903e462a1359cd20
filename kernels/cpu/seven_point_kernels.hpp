// Seven-point samples on vectors, a function for each instruction set the build knows (seven_point_kernels.cpp).
#pragma once

#include <vector>

#include "kernels/seven_point.hpp"

namespace swarmfit::kernels::cpu {

struct SevenPointKernels {
  const char* name;
  void (*solve)(const SevenPointSamples& samples, SevenPointPencils& pencils);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const SevenPointKernels*>& available_seven_point_kernels();

}  // namespace swarmfit::kernels::cpu
