#include "kernels/cpu/wake_elsewhere.hpp"

#if defined(__linux__)
#include <mutex>

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace swarmfit::kernels::cpu {

#if defined(__linux__)

namespace {

/// Of one thread's processors there is one change at a time: several may be about to wake it.
std::mutex& changes() noexcept {
  static std::mutex mutex;
  return mutex;
}

/// The processor becomes one of the thread's, or is no more; false if nothing changed.
bool change(ThreadNumber thread, int processor, bool may) noexcept {
  const std::lock_guard lock(changes());
  const auto at = static_cast<std::size_t>(processor);
  cpu_set_t its;
  if (sched_getaffinity(thread, sizeof its, &its) != 0 || (CPU_ISSET(at, &its) != 0) == may) return false;
  if (may) {
    CPU_SET(at, &its);
  } else {
    CPU_CLR(at, &its);
  }
  return CPU_COUNT(&its) > 0 && sched_setaffinity(thread, sizeof its, &its) == 0;
}

}  // namespace

ThreadNumber this_thread() noexcept { return static_cast<ThreadNumber>(syscall(SYS_gettid)); }

void WakeElsewhere::keep_off(ThreadNumber thread) noexcept {
  const int here = sched_getcpu();
  if (thread == 0 || here < 0 || kept_off_.size() == kept_off_.capacity()) return;
  if (change(thread, here, false)) kept_off_.push_back({thread, here});
}

void WakeElsewhere::let_roam() noexcept {
  for (const KeptOff& one : kept_off_) change(one.thread, one.processor, true);
  kept_off_.clear();
}

#else

ThreadNumber this_thread() noexcept { return 0; }
void WakeElsewhere::keep_off(ThreadNumber) noexcept {}
void WakeElsewhere::let_roam() noexcept {}

#endif

}  // namespace swarmfit::kernels::cpu
