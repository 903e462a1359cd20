// Least squares on correspondences on vectors, functions for each instruction set the build knows (pair_kernels.cpp).
#pragma once

#include <vector>

#include "kernels/pair_sums.hpp"

namespace swarmfit::kernels::cpu {

struct PairKernels {
  const char* name;
  void (*add_sums)(PairResidual residual, const double* matrix, const WeightedPairs& pairs, PairSums& sums);
  double (*squares)(PairResidual residual, const double* matrix, const WeightedPairs& pairs);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const PairKernels*>& available_pair_kernels();

}  // namespace swarmfit::kernels::cpu
