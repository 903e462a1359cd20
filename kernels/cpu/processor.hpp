// What the back ends on the processor share beside their arithmetic: its threads, and what happens where memory runs out.
#pragma once

#include <algorithm>
#include <cstddef>
#include <new>
#include <thread>

#include <fmt/format.h>

#include "kernels/status.hpp"

namespace swarmfit::kernels::cpu {

inline constexpr int kMaxThreads = 4096;

/// That this process may run on. Not asked of TBB, which would start its scheduler.
inline int processors() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

/// Of so many wanted, 0 for all; more threads than processors would only be refused, aloud, by TBB.
inline Result<int> choose_threads(int wanted) {
  if (wanted < 0 || wanted > kMaxThreads) {
    return fail(Failure::Kind::invalid, fmt::format("threads is {}, must be in [0, {}]", wanted, kMaxThreads));
  }
  return wanted > 0 ? std::min(wanted, processors()) : processors();
}

/// Work that may run out of memory, with the failure as a value.
template <class Work>
Result<> guarded(std::size_t points, Work&& work) {
  try {
    work();
    return {};
  } catch (const std::bad_alloc&) {
    return fail(Failure::Kind::out_of_memory, fmt::format("host memory does not hold {} points", points));
  }
}

}  // namespace swarmfit::kernels::cpu
