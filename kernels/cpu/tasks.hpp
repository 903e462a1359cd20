// Work in tasks: on the threads of a crew, or here where it is done before another thread would have begun.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <utility>

#include <oneapi/tbb/parallel_for.h>

#include "kernels/cpu/crew.hpp"

namespace swarmfit::kernels::cpu {

/// Points that one task takes at least, wherever points are shared out.
inline constexpr std::size_t kTaskPoints = 2048;

/// Is a pass over so many points worth sharing between threads?
constexpr bool worth_sharing(std::size_t points) noexcept { return points > kTaskPoints; }
/// Is a pass that does no more than copy them?
constexpr bool worth_sharing_copy(std::size_t points) noexcept { return points > 16 * kTaskPoints; }
/// Are so many residuals?
constexpr bool worth_sharing(std::size_t points, std::size_t models) noexcept { return points * models > std::size_t{1} << 17; }

/// The crew that the calling thread's tasks are shared out to, within run_in.
inline Crew*& current_crew() noexcept {
  static thread_local Crew* current = nullptr;
  return current;
}

/// Nobody but who calls. It keeps nothing, so that any number of threads may be it.
inline Crew& nobody_else() {
  static Crew alone(1);
  return alone;
}

/// Threads that tasks are shared out to where this is called.
inline std::size_t workers() noexcept { return current_crew() != nullptr ? static_cast<std::size_t>(current_crew()->threads()) : 1; }

/// body(task, member) for each task on the threads of the crew, which are members below `workers()`; here where there is none. A member
/// that finds no more tasks ends with finish(member).
template <class Body, class Finish>
void for_each_task_as_member(std::size_t tasks, Body&& body, Finish&& finish) {
  if (Crew* crew = current_crew(); crew != nullptr) {
    struct Both {
      std::remove_reference_t<Body>& body;
      std::remove_reference_t<Finish>& finish;
    } both{body, finish};
    const Crew::Work work{[](void* context, std::size_t task, std::size_t member) { static_cast<Both*>(context)->body(task, member); },
                          [](void* context, std::size_t member) { static_cast<Both*>(context)->finish(member); }};
    crew->run(tasks, work, &both);
  } else {
    for (std::size_t task = 0; task < tasks; ++task) body(task, std::size_t{0});
    finish(std::size_t{0});
  }
}

/// body(task) for each task; one alone is done here. More than one run on the threads of the crew that this is called in, or of TBB where
/// there is none.
template <class Body>
void for_each_task(std::size_t tasks, Body&& body) {
  if (tasks == 1) {
    body(std::size_t{0});
  } else if (current_crew() != nullptr) {
    for_each_task_as_member(
        tasks, [&](std::size_t task, std::size_t) { body(task); }, [](std::size_t) {});
  } else if (tasks > 1) {
    tbb::parallel_for(std::size_t{0}, tasks, body);
  }
}

/// Work whose tasks are shared out to the crew, or else done by the caller alone, whatever the work is a part of.
template <class Work>
void run_in(Crew& crew, bool shared, Work&& work) {
  struct Within {
    explicit Within(Crew* crew) : before(std::exchange(current_crew(), crew)) {}
    ~Within() { current_crew() = before; }
    Crew* before;
  };
  const Within within(shared ? &crew : &nobody_else());
  work();
}

}  // namespace swarmfit::kernels::cpu
