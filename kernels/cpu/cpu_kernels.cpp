// One body, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // models keep vectors in arrays
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/cpu_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/cpu/cpu_kernels-inl.hpp"

#if HWY_ONCE
namespace swarmfit::kernels::cpu {

HWY_EXPORT(kernel_table);

const std::vector<const CpuKernels*>& available_kernels() {
  static const std::vector<const CpuKernels*> all = [] {
    std::vector<const CpuKernels*> found;
    constexpr std::size_t slots = sizeof HWY_DISPATCH_TABLE(kernel_table) / sizeof HWY_DISPATCH_TABLE(kernel_table)[0];
    for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
      // Highway's table: slot 0 dispatches, then the targets from the best down, the fallback last.
      const auto mask = static_cast<std::uint64_t>(HWY_CHOSEN_TARGET_SHIFT(target) | HWY_CHOSEN_TARGET_MASK_SCALAR);
      const std::size_t slot = slots == 1 ? 0 : hwy::Num0BitsBelowLS1Bit_Nonzero64(mask);
      found.push_back(&HWY_DISPATCH_TABLE(kernel_table)[slot]());
    }
    return found;
  }();
  return all;
}

}  // namespace swarmfit::kernels::cpu
#endif  // HWY_ONCE
