// Work in tasks: on the threads of an arena, or here where it is done before another thread would have woken up.
#pragma once

#include <algorithm>
#include <cstddef>

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace swarmfit::kernels::cpu {

/// Points that one task takes at least, wherever points are shared out.
inline constexpr std::size_t kTaskPoints = 2048;

/// Is a pass over so many points worth sharing between threads?
constexpr bool worth_sharing(std::size_t points) noexcept { return points > kTaskPoints; }
/// Are so many residuals?
constexpr bool worth_sharing(std::size_t points, std::size_t models) noexcept { return points * models > std::size_t{1} << 18; }

/// body(task) for each task; one alone is done here. More than one run on the threads of the arena that this is called in.
template <class Body>
void for_each_task(std::size_t tasks, Body&& body) {
  if (tasks == 1) {
    body(std::size_t{0});
  } else if (tasks > 1) {
    tbb::parallel_for(std::size_t{0}, tasks, body);
  }
}

/// Work on the arena's threads where it is shared, else on the caller's.
template <class Work>
void run_in(tbb::task_arena& arena, bool shared, Work&& work) {
  if (shared) {
    arena.execute(work);
  } else {
    work();
  }
}

}  // namespace swarmfit::kernels::cpu
