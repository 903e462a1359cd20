// What this processor could do at best: the yardstick of the benchmark.
#pragma once

#include "kernels/status.hpp"

namespace swarmfit::kernels {

struct MachineLimit {
  double fma_per_s = 0;  ///< scalar fused multiply-adds a second, all threads together, in registers and with nothing else to do
  int threads = 0;
};

/// Measures for about `seconds` on so many threads (0: all) with the best instruction set and gives the best window of several.
/// Fails with `invalid` if threads is out of [0, 4096] or seconds is not > 0.
Result<MachineLimit> measure_machine_limit(int threads, double seconds);

}  // namespace swarmfit::kernels
