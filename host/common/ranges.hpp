// Places that are worked on in ranges side by side, on the threads of a back end.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::common {

/// some(first, last) for ranges of `range` places that together make up [0, count): on the threads that share the work of `workers`, or
/// here and at once where that is null or there are no more than `few`.
template <class Some>
void in_ranges(kernels::FitnessEvaluator* workers, std::size_t count, std::size_t range, std::size_t few, Some&& some) {
  if (workers == nullptr || count <= few) return some(std::size_t{0}, count);
  const auto one = [&](std::size_t k) { some(k * range, std::min(count, (k + 1) * range)); };
  workers->share_out((count + range - 1) / range, std::cref(one));  // a reference fits where a function is kept
}

}  // namespace swarmfit::common
