// What Highway compiled for each instruction set, as a list. For the files that export such tables, where HWY_ONCE holds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <hwy/highway.h>

namespace swarmfit::kernels::cpu {

/// Of `table`, HWY_DISPATCH_TABLE of a function that gives an instruction set's kernels: those that this processor can run, best first.
template <class Kernels, std::size_t Slots>
std::vector<const Kernels*> runnable(const Kernels& (*const (&table)[Slots])()) {
  std::vector<const Kernels*> found;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    // Highway's table: slot 0 dispatches, then the targets from the best down, the fallback last.
    const auto mask = static_cast<std::uint64_t>(HWY_CHOSEN_TARGET_SHIFT(target) | HWY_CHOSEN_TARGET_MASK_SCALAR);
    const std::size_t slot = Slots == 1 ? 0 : hwy::Num0BitsBelowLS1Bit_Nonzero64(mask);
    found.push_back(&table[slot]());
  }
  return found;
}

}  // namespace swarmfit::kernels::cpu
