// One body, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // models keep vectors in arrays
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/cpu_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/cpu/cpu_kernels-inl.hpp"

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels::cpu {

HWY_EXPORT(kernel_table);

const std::vector<const CpuKernels*>& available_kernels() {
  static const std::vector<const CpuKernels*> all = runnable(HWY_DISPATCH_TABLE(kernel_table));
  return all;
}

}  // namespace swarmfit::kernels::cpu
#endif  // HWY_ONCE
