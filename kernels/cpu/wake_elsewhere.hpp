// Where a thread that slept wakes up. In a virtual machine Linux takes a processor that has long had nothing to do for one that the
// host has taken away, and wakes a thread on the waker's own, where it waits for the waker's time slice to end: one to three
// milliseconds, as long as a fit. So the thread is kept off that processor until it is awake.
#pragma once

namespace swarmfit::kernels::cpu {

/// Number of a thread by which others may choose its processors; 0 is none.
using ThreadNumber = int;

/// The caller's own; 0 where the system does not tell.
ThreadNumber this_thread() noexcept;

/// From now on the thread runs on any of its processors but the caller's; false where it does as before: if it has no other, is kept off
/// one already or is no more; on a machine of its own, on other systems than Linux, and in a process that was forked, whose threads they
/// are not. A thread that was kept off once has an affinity of its own from then on: that which it had.
bool keep_off_this_processor(ThreadNumber thread) noexcept;

/// A thread that was kept off runs where it might before, unless somebody has chosen otherwise meanwhile. From any thread, itself included.
void let_roam(ThreadNumber thread) noexcept;

}  // namespace swarmfit::kernels::cpu
