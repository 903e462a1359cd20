// The CPU back end's threads: every task once, whatever the number of threads and however long they slept.
#include "kernels/cpu/crew.hpp"

#include <atomic>
#include <chrono>
#include <filesystem>
#include <new>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#if defined(__linux__)
#include <sched.h>
#endif

#include "kernels/cpu/tasks.hpp"
#include "kernels/cpu/wake_elsewhere.hpp"

namespace swarmfit::kernels::cpu {
namespace {

/// How often each of so many tasks was done.
std::vector<int> done_by(Crew& crew, std::size_t tasks) {
  std::vector<std::atomic<int>> times(tasks);
  run_in(crew, true, [&] { for_each_task(tasks, [&](std::size_t task) { ++times[task]; }); });
  return {times.begin(), times.end()};
}

class CrewOf : public testing::TestWithParam<int> {};

TEST_P(CrewOf, DoesEveryTaskOnce) {
  Crew crew(GetParam());
  for (const std::size_t tasks : {0U, 1U, 2U, 3U, 7U, 64U, 1000U}) {
    for (int again = 0; again < 50; ++again) EXPECT_EQ(done_by(crew, tasks), std::vector<int>(tasks, 1));
  }
}

TEST_P(CrewOf, WakesUpAgain) {
  Crew crew(GetParam());
  for (int again = 0; again < 5; ++again) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // longer than helpers stay awake
    EXPECT_EQ(done_by(crew, 100), std::vector<int>(100, 1));
  }
}

TEST_P(CrewOf, SeesWhatItsTasksWrote) {
  Crew crew(GetParam());
  std::vector<std::size_t> numbers(5000);
  for (std::size_t round = 1; round < 200; ++round) {
    run_in(crew, true, [&] { for_each_task(numbers.size(), [&](std::size_t task) { numbers[task] += task * round; }); });
  }
  for (std::size_t task = 0; task < numbers.size(); ++task) ASSERT_EQ(numbers[task], task * (199 * 200 / 2));
}

TEST_P(CrewOf, GivesEachMemberToOneThread) {
  Crew crew(GetParam());
  const auto members = static_cast<std::size_t>(GetParam());
  for (int again = 0; again < 200; ++again) {
    // Were two threads the same member at a time, some of what they count would be lost.
    std::vector<std::size_t> counts(members);
    std::atomic<bool> beyond = false;
    std::atomic<std::size_t> handed_in = 0;
    const auto count = [&](std::size_t, std::size_t member) {
      if (member >= members) {
        beyond = true;
      } else {
        ++counts[member];
      }
    };
    // What a member has gathered is handed in by itself, when it has done its last task.
    run_in(crew, true,
           [&] { for_each_task_as_member(2000, count, [&](std::size_t member) { handed_in += std::exchange(counts[member], 0); }); });
    ASSERT_FALSE(beyond);
    ASSERT_EQ(handed_in, 2000U);
    ASSERT_EQ(std::accumulate(counts.begin(), counts.end(), std::size_t{0}), 0U);
    if (again % 50 == 49) std::this_thread::sleep_for(std::chrono::milliseconds(3));  // helpers go, and others come
  }
}

TEST_P(CrewOf, ThrowsWhatATaskThrewAndGoesOn) {
  Crew crew(GetParam());
  for (int again = 0; again < 20; ++again) {
    const auto failing = [&] {
      run_in(crew, true, [&] {
        for_each_task(50, [&](std::size_t task) {
          if (task == 31) throw std::bad_alloc();
        });
      });
    };
    EXPECT_THROW(failing(), std::bad_alloc);
    EXPECT_EQ(current_crew(), nullptr);
    EXPECT_EQ(done_by(crew, 20), std::vector<int>(20, 1));
  }
}

TEST_P(CrewOf, MayGoWhileHelpersAreAwake) {
  for (int again = 0; again < 100; ++again) {
    Crew crew(GetParam());
    EXPECT_EQ(done_by(crew, 3), std::vector<int>(3, 1));
  }
}

TEST_P(CrewOf, WorksBesideOthers) {
  std::vector<std::jthread> callers;
  std::atomic<int> wrong = 0;
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&] {
      Crew crew(GetParam());
      for (int again = 0; again < 200; ++again) wrong += done_by(crew, 9) != std::vector<int>(9, 1) ? 1 : 0;
    });
  }
  callers.clear();
  EXPECT_EQ(wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Threads, CrewOf, testing::Values(1, 2, 3, 8));

#if defined(__linux__)

cpu_set_t processors_of(ThreadNumber thread) {
  cpu_set_t its;
  CPU_ZERO(&its);
  sched_getaffinity(thread, sizeof its, &its);
  return its;
}

/// Puts the calling thread where it was when it goes out of scope.
class OnOneProcessor {
 public:
  OnOneProcessor() : before_(processors_of(0)) {
    cpu_set_t here;
    CPU_ZERO(&here);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &here);
    sched_setaffinity(0, sizeof here, &here);
  }
  ~OnOneProcessor() { sched_setaffinity(0, sizeof before_, &before_); }
  OnOneProcessor(const OnOneProcessor&) = delete;
  OnOneProcessor& operator=(const OnOneProcessor&) = delete;

 private:
  cpu_set_t before_;
};

TEST(WakeElsewhere, KeepsAThreadOffTheCallersProcessorUntilItMayRoam) {
  std::atomic<ThreadNumber> number = 0;
  std::jthread sleeper([&](const std::stop_token& stop) {
    number = this_thread();
    number.notify_one();
    while (!stop.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  number.wait(0);
  const cpu_set_t all = processors_of(number);
  if (CPU_COUNT(&all) < 2) GTEST_SKIP() << "one processor";
  const OnOneProcessor stay;
  const auto here = static_cast<std::size_t>(sched_getcpu());
  const auto kept_off = [&] {
    const cpu_set_t its = processors_of(number);
    return CPU_ISSET(here, &its) == 0 && CPU_COUNT(&its) == CPU_COUNT(&all) - 1;
  };
  const auto roams = [&] {
    const cpu_set_t its = processors_of(number);
    return CPU_EQUAL(&its, &all) != 0;
  };
  if (!keep_off_this_processor(number)) GTEST_SKIP() << "no virtual machine";
  EXPECT_TRUE(kept_off());
  EXPECT_FALSE(keep_off_this_processor(number)) << "it is already";
  let_roam(number);
  EXPECT_TRUE(roams());
  let_roam(number);
  EXPECT_TRUE(roams());
  // What somebody else has chosen meanwhile stays; and a thread with no other processor stays where it is.
  ASSERT_TRUE(keep_off_this_processor(number));
  const cpu_set_t only = processors_of(0);
  sched_setaffinity(number, sizeof only, &only);
  let_roam(number);
  const auto stays = [&] {
    const cpu_set_t its = processors_of(number);
    return CPU_EQUAL(&its, &only) != 0;
  };
  EXPECT_TRUE(stays());
  EXPECT_FALSE(keep_off_this_processor(number));
  EXPECT_TRUE(stays());
}

/// Those of this process that may not run where the caller may.
std::size_t threads_kept_off(const cpu_set_t& own) {
  std::size_t count = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    const cpu_set_t its = processors_of(std::stoi(task.path().filename().string()));
    count += CPU_COUNT(&its) > 0 && CPU_EQUAL(&its, &own) == 0 ? 1 : 0;  // none of one that has just ended
  }
  return count;
}

TEST_P(CrewOf, LeavesEveryThreadTheProcessorsItHad) {
  const cpu_set_t own = processors_of(0);
  constexpr int kCallers = 3;
  std::vector<std::jthread> callers;
  callers.reserve(kCallers);
  for (int caller = 0; caller < kCallers; ++caller) {
    callers.emplace_back([&] {
      Crew crew(GetParam());
      for (int again = 0; again < 20; ++again) {
        done_by(crew, 9);
        std::this_thread::sleep_for(std::chrono::microseconds(1500));  // helpers are about to go, or have gone
      }
    });
  }
  callers.clear();
  EXPECT_EQ(threads_kept_off(own), 0U);
  Crew crew(GetParam());
  for (int again = 0; again < 10; ++again) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    done_by(crew, 9);
    EXPECT_EQ(threads_kept_off(own), 0U) << "while the crew is there, after its work";
  }
}

#endif

TEST(Tasks, RunWithoutACrewAsWell) {
  std::vector<std::atomic<int>> times(40);
  for_each_task(times.size(), [&](std::size_t task) { ++times[task]; });
  for (const auto& count : times) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace swarmfit::kernels::cpu
