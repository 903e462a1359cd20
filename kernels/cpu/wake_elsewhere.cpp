#include "kernels/cpu/wake_elsewhere.hpp"

#include <hwy/base.h>

#if defined(__linux__)
#include <algorithm>
#include <array>
#include <mutex>
#include <span>

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif
#if HWY_ARCH_X86
#include <cpuid.h>
#endif

namespace swarmfit::kernels::cpu {

#if defined(__linux__)

namespace {

/// The threads of this process that are kept off a processor, by whomever.
class KeptOff {
 public:
  bool add(ThreadNumber thread, int processor) noexcept {
    const std::lock_guard lock(mutex_);
    const std::span<const One> all = std::span(all_).first(count_);
    const bool known = std::any_of(all.begin(), all.end(), [&](const One& one) { return one.thread == thread; });
    if (known || count_ == all_.size()) return false;
    One& one = all_[count_];
    one.thread = thread;
    if (sched_getaffinity(thread, sizeof one.before, &one.before) != 0) return false;
    one.now = one.before;
    CPU_CLR(static_cast<std::size_t>(processor), &one.now);
    if (CPU_COUNT(&one.now) == 0 || CPU_EQUAL(&one.now, &one.before)) return false;
    if (sched_setaffinity(thread, sizeof one.now, &one.now) != 0) return false;
    ++count_;
    return true;
  }

  void remove(ThreadNumber thread) noexcept {
    const std::lock_guard lock(mutex_);
    const auto end = all_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto one = std::find_if(all_.begin(), end, [&](const One& kept) { return kept.thread == thread; });
    if (one == end) return;
    cpu_set_t its;
    const bool as_left = sched_getaffinity(thread, sizeof its, &its) == 0 && CPU_EQUAL(&its, &one->now);
    if (as_left) sched_setaffinity(thread, sizeof one->before, &one->before);
    *one = all_[--count_];
  }

  /// In a child that was forked the threads are its parent's, and who held the mutex is not there.
  bool is_this_process() const noexcept { return getpid() == process_; }

 private:
  struct One {
    ThreadNumber thread;
    cpu_set_t before, now;
  };
  static constexpr std::size_t kMost = 64;  // at a time; more wake as they would

  const pid_t process_ = getpid();
  std::mutex mutex_;
  std::array<One, kMost> all_{};
  std::size_t count_ = 0;
};

KeptOff& kept_off() noexcept {
  static KeptOff all;
  return all;
}

/// Where a processor does not tell, it may be.
bool in_virtual_machine() noexcept {
#if HWY_ARCH_X86
  static const bool told = [] {
    constexpr unsigned kFeatures = 1, kHypervisor = 1U << 31;
    unsigned a = 0, b = 0, c = 0, d = 0;
    return __get_cpuid(kFeatures, &a, &b, &c, &d) != 0 && (c & kHypervisor) != 0;
  }();
  return told;
#else
  return true;
#endif
}

}  // namespace

ThreadNumber this_thread() noexcept { return static_cast<ThreadNumber>(syscall(SYS_gettid)); }

bool keep_off_this_processor(ThreadNumber thread) noexcept {
  if (thread == 0 || !in_virtual_machine() || !kept_off().is_this_process()) return false;
  const int here = sched_getcpu();
  return here >= 0 && kept_off().add(thread, here);
}

void let_roam(ThreadNumber thread) noexcept {
  if (thread != 0 && kept_off().is_this_process()) kept_off().remove(thread);
}

#else

ThreadNumber this_thread() noexcept { return 0; }
bool keep_off_this_processor(ThreadNumber) noexcept { return false; }
void let_roam(ThreadNumber) noexcept {}

#endif

}  // namespace swarmfit::kernels::cpu
