// Threads that stay awake between the many short pieces of work of a fit.
#pragma once

#include <cstddef>
#include <memory>

namespace swarmfit::kernels::cpu {

/// Tasks on oneTBB's threads, begun within a microsecond. A thread that TBB has sent to sleep takes tens of them to wake, as long as one
/// step of a swarm takes; so those that helped once look for more for a short while before they go. One that has gone is woken on another
/// processor than the caller's (wake_elsewhere.hpp). The caller works along and waits for nobody who has not begun. One thread at a time
/// may call.
class Crew {
 public:
  /// threads >= 1, the caller's among them.
  explicit Crew(int threads);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  int threads() const noexcept { return helpers_ + 1; }

  struct Work {
    void (*body)(void* context, std::size_t task, std::size_t member);
    void (*finish)(void* context, std::size_t member);
  };
  /// work.body for each task, in any order and on any thread, and work.finish of each member that took part, the last of its doing. No two
  /// threads are the same member, of `threads()`, at a time; the caller is the first. The first exception is thrown here, when all have
  /// ended.
  void run(std::size_t tasks, const Work& work, void* context);

 private:
  struct Shared;
  class Arena;

  void call_helpers(std::size_t wanted);

  int helpers_;
  std::shared_ptr<Shared> shared_;
  std::unique_ptr<Arena> arena_;
};

}  // namespace swarmfit::kernels::cpu
