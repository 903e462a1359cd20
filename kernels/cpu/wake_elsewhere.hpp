// Where a thread that slept wakes up.
#pragma once

#include <cstddef>
#include <vector>

namespace swarmfit::kernels::cpu {

/// Number of a thread by which others may choose its processors; 0 is none.
using ThreadNumber = int;

/// The caller's own; 0 where the system does not tell.
ThreadNumber this_thread() noexcept;

/// Keeps threads that are about to be woken off the processor of who wakes them. In a virtual machine Linux takes a processor that has
/// long had nothing to do for one that the host has taken away, and wakes a thread on the waker's own, where it waits for the waker's time
/// slice to end: one to three milliseconds, as long as a fit. Elsewhere this changes nothing; on other systems than Linux it does nothing.
class WakeElsewhere {
 public:
  /// Room for so many threads.
  explicit WakeElsewhere(std::size_t threads) { kept_off_.reserve(threads); }
  ~WakeElsewhere() { let_roam(); }
  WakeElsewhere(const WakeElsewhere&) = delete;
  WakeElsewhere& operator=(const WakeElsewhere&) = delete;

  /// The thread wakes on any of its processors but the caller's, unless it has no other, there is no room or it is no more.
  void keep_off(ThreadNumber thread) noexcept;
  /// Those that were kept off may run where they might before.
  void let_roam() noexcept;

 private:
  struct KeptOff {
    ThreadNumber thread;
    int processor;
  };
  std::vector<KeptOff> kept_off_;
};

}  // namespace swarmfit::kernels::cpu
