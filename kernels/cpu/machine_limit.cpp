#include "kernels/machine_limit.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <system_error>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <oneapi/tbb/info.h>

#include "kernels/cpu/cpu_kernels.hpp"

namespace swarmfit::kernels {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMaxThreads = 4096;
constexpr int kWindows = 5;
constexpr std::size_t kRounds = 20000;  // some tens of microseconds

/// Multiply-adds of all threads in one window, over its length.
double one_window(const cpu::CpuKernels& kernels, int threads, double seconds) {
  std::atomic<int> waiting{threads};
  std::vector<double> done(static_cast<std::size_t>(threads), 0.0);
  std::vector<double> taken(static_cast<std::size_t>(threads), 0.0);
  const auto work = [&](std::size_t thread) {
    float sink = 0;
    kernels.spin_fma(kRounds, &sink);  // out of any power-saving state
    --waiting;
    while (waiting.load() > 0) std::this_thread::yield();
    const auto start = Clock::now();
    do {
      done[thread] += kernels.spin_fma(kRounds, &sink);
      taken[thread] = std::chrono::duration<double>(Clock::now() - start).count();
    } while (taken[thread] < seconds);
  };
  {
    std::vector<std::jthread> pool;
    try {
      for (int t = 1; t < threads; ++t) pool.emplace_back(work, static_cast<std::size_t>(t));
    } catch (...) {
      waiting = 0;  // those that did start must not wait for the others
      throw;
    }
    work(0);
  }
  double total = 0;
  for (std::size_t t = 0; t < done.size(); ++t) total += done[t] / taken[t];
  return total;
}

}  // namespace

Result<MachineLimit> measure_machine_limit(int threads, double seconds) {
  if (threads < 0 || threads > kMaxThreads) {
    return fail(Failure::Kind::invalid, fmt::format("threads is {}, must be in [0, {}]", threads, kMaxThreads));
  }
  if (!(seconds > 0)) return fail(Failure::Kind::invalid, fmt::format("seconds is {}, must be > 0", seconds));
  MachineLimit limit;
  limit.threads = threads > 0 ? threads : tbb::info::default_concurrency();
  try {
    for (int window = 0; window < kWindows; ++window) {
      limit.fma_per_s = std::max(limit.fma_per_s, one_window(*cpu::available_kernels().front(), limit.threads, seconds / kWindows));
    }
  } catch (const std::system_error&) {
    return fail(Failure::Kind::unavailable, fmt::format("threads is {}, more than this system starts", limit.threads));
  }
  return limit;
}

}  // namespace swarmfit::kernels
