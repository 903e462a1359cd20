#include "kernels/cpu/crew.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

#include <hwy/base.h>
#include <oneapi/tbb/task_arena.h>

#if HWY_ARCH_X86
#include <immintrin.h>
#endif

#include "kernels/cpu/wake_elsewhere.hpp"

namespace swarmfit::kernels::cpu {
namespace {

using Clock = std::chrono::steady_clock;

/// How long a helper without work looks for more: longer than whatever a fit does by itself between two passes over its points.
constexpr auto kAwake = std::chrono::microseconds(1000);
/// How long helpers are waited for at the end; they go as soon as they have a thread to go with.
constexpr auto kPatience = std::chrono::milliseconds(100);
/// Looks before a thread that waits lets others have its processor, each time it looks in vain.
constexpr int kLooks = 2000;

void breathe() {
#if HWY_ARCH_X86
  _mm_pause();
#endif
}

}  // namespace

/// Written by the caller of `run`, read by helpers. A helper counts itself `inside` before it looks whether there is work; the caller ends
/// the work and then waits until nobody is inside, so that nobody sees half of the next.
struct Crew::Shared {
  Work job{};
  void* context = nullptr;
  std::exception_ptr failure;
  std::atomic_flag failed;

  /// The tasks that one member takes first: consecutive ones, the same each time where there are as many tasks. What they work on is then
  /// in that thread's caches from the time before.
  struct alignas(64) Share {
    std::atomic<std::size_t> next = 0;
    std::size_t end = 0;
    std::atomic_flag taken;                 ///< a helper is this member
    std::atomic<ThreadNumber> sleeper = 0;  ///< the thread that was, since it went and until it comes again, as whatever member
    ThreadNumber kept_off = 0;              ///< a sleeper that the caller has woken elsewhere, while it is at work
  };
  std::vector<Share> shares;  ///< a member; the caller's first

  alignas(64) std::atomic<std::uint64_t> work = 0;  ///< number of the piece of work, odd while there is some
  alignas(64) std::atomic<int> inside = 0;
  std::atomic<int> awake = 0;  ///< helpers called and not gone
  std::atomic<bool> closing = false;

  explicit Shared(std::size_t threads) : shares(threads) {}

  void share_out(std::size_t tasks) {
    std::size_t begin = 0;
    for (std::size_t s = 0; s < shares.size(); ++s) {
      shares[s].next.store(begin, std::memory_order_relaxed);
      begin = shares[s].end = tasks / shares.size() * (s + 1) + std::min(tasks % shares.size(), s + 1);
    }
  }

  /// A thread's own share, then what others have not come to.
  void take_tasks(std::size_t own) {
    for (std::size_t s = 0; s < shares.size(); ++s) {
      Share& share = shares[(own + s) % shares.size()];
      while (share.next.load(std::memory_order_relaxed) < share.end) {
        const std::size_t task = share.next.fetch_add(1, std::memory_order_relaxed);
        if (task < share.end) attempt([&] { job.body(context, task, own); });
      }
    }
    attempt([&] { job.finish(context, own); });
  }

  template <class Do>
  void attempt(Do&& act) {
    if (failed.test(std::memory_order_relaxed)) return;
    try {
      act();
    } catch (...) {
      if (!failed.test_and_set()) failure = std::current_exception();
    }
  }

  /// There are no more helpers awake than members to be.
  std::size_t become_member() {
    std::size_t member = 1;
    while (shares[member].taken.test_and_set(std::memory_order_acquire)) member = member % (shares.size() - 1) + 1;
    return member;
  }

  /// The calling thread sleeps no longer, and may go where it likes.
  void is_awake() noexcept {
    const ThreadNumber own = this_thread();
    let_roam(own);
    for (Share& share : shares) {
      ThreadNumber expected = own;
      share.sleeper.compare_exchange_strong(expected, 0, std::memory_order_relaxed);
    }
  }

  /// Helps with what there is and what comes, and goes when nothing has come for a while.
  void help() {
    is_awake();
    const std::size_t own = become_member();
    std::uint64_t done = 0;
    auto since = Clock::now();
    for (int looks = 0; !closing.load(std::memory_order_relaxed); ++looks) {
      const std::uint64_t seen = work.load(std::memory_order_acquire);
      if (seen % 2 == 1 && seen != done) {
        inside.fetch_add(1);
        if (work.load() == seen) take_tasks(own);
        inside.fetch_sub(1);
        done = seen;
        looks = 0;
        since = Clock::now();
        continue;
      }
      breathe();
      if (looks % 64 != 63) continue;
      if (Clock::now() - since > kAwake) break;
      if (looks > kLooks) std::this_thread::yield();
    }
    shares[own].sleeper.store(this_thread(), std::memory_order_relaxed);
    shares[own].taken.clear(std::memory_order_release);
    awake.fetch_sub(1);  // who waits for this ends the arena
  }
};

class Crew::Arena {
 public:
  explicit Arena(int threads) : arena_(threads) { arena_.initialize(); }
  template <class Work>
  void enqueue(Work&& work) {
    arena_.enqueue(std::forward<Work>(work));
  }

 private:
  tbb::task_arena arena_;
};

// The arena is made here and not in the first fit, and its threads are called once: what TBB looks up about the machine, and starting
// them, takes milliseconds.
Crew::Crew(int threads)
    : helpers_(threads - 1),
      shared_(std::make_shared<Shared>(static_cast<std::size_t>(threads))),
      arena_(threads > 1 ? std::make_unique<Arena>(threads) : nullptr) {
  if (arena_) call_helpers(static_cast<std::size_t>(helpers_));
}

Crew::~Crew() {
  shared_->closing = true;
  const auto since = Clock::now();
  while (shared_->awake.load() > 0) {
    std::this_thread::yield();
    // Those that TBB has found no thread for have a share in it, and see that it is closed, should it ever find one.
    if (Clock::now() - since > kPatience) return;
  }
}

void Crew::call_helpers(std::size_t wanted) {
  const int most = static_cast<int>(std::min(wanted, static_cast<std::size_t>(helpers_)));
  int missing = most - shared_->awake.load(std::memory_order_relaxed);
  for (Shared::Share& share : shared_->shares) {
    if (missing <= 0) break;
    const ThreadNumber sleeper = share.sleeper.load(std::memory_order_relaxed);
    if (sleeper == 0) continue;
    if (keep_off_this_processor(sleeper)) share.kept_off = sleeper;
    --missing;
  }
  while (shared_->awake.load(std::memory_order_relaxed) < most) {
    shared_->awake.fetch_add(1);
    try {
      arena_->enqueue([shared = shared_] { shared->help(); });
    } catch (...) {
      shared_->awake.fetch_sub(1);  // the caller alone does it as well, and who comes all the same does no harm
      return;
    }
  }
}

void Crew::run(std::size_t tasks, const Work& work, void* context) {
  if (tasks == 0) return;
  if (helpers_ == 0 || tasks == 1) {
    for (std::size_t task = 0; task < tasks; ++task) work.body(context, task, 0);
    work.finish(context, 0);
    return;
  }
  Shared& shared = *shared_;
  shared.job = work;
  shared.context = context;
  shared.failed.clear();
  shared.share_out(tasks);
  shared.work.fetch_add(1);
  call_helpers(tasks - 1);
  shared.take_tasks(0);
  shared.work.fetch_add(1);
  for (int looks = 0; shared.inside.load() > 0; ++looks) {
    breathe();
    if (looks > kLooks) std::this_thread::yield();
  }
  for (Shared::Share& share : shared.shares) {
    if (share.kept_off != 0) let_roam(std::exchange(share.kept_off, 0));  // it may not have come yet
  }
  if (shared.failed.test()) std::rethrow_exception(std::exchange(shared.failure, nullptr));
}

}  // namespace swarmfit::kernels::cpu
