#include "host/cli/console.hpp"

#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>

#include <pthread.h>
#include <unistd.h>

#include <fmt/format.h>

namespace swarmfit::cli {
namespace {

std::string on_one_line(std::string_view message) {
  std::string line(message);
  while (!line.empty() && (line.back() == '\n' || line.back() == ' ')) line.pop_back();
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return line;
}

sigset_t interrupts() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

}  // namespace

int exit_code(Error::Kind kind) noexcept {
  switch (kind) {
    case Error::Kind::invalid_option: return kWrongUsage;
    case Error::Kind::backend_unavailable: return kNoBackend;
    case Error::Kind::bad_input:
    case Error::Kind::out_of_memory:
    case Error::Kind::cannot_write: return kBadInput;
  }
  return kBadInput;
}

void note(std::string_view message) { fmt::print(stderr, "swarmfit: {}\n", on_one_line(message)); }

int complain(const Error& error) {
  note(error.message);
  return exit_code(error.kind);
}

int wrong_usage(std::string_view message) {
  note(message);
  return kWrongUsage;
}

Progress::Progress(bool quiet) {
  if (!quiet && ::isatty(STDERR_FILENO) == 1) ticker_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Progress::~Progress() = default;

void Progress::say(std::string what) {
  const std::scoped_lock lock(mutex_);
  what_ = std::move(what);
}

void Progress::run(const std::stop_token& stop) {
  using namespace std::chrono_literals;
  std::condition_variable_any wake;
  std::mutex asleep;
  std::unique_lock lock(asleep);
  bool shown = false;
  for (auto wait = 1000ms; !wake.wait_for(lock, stop, wait, [&] { return stop.stop_requested(); }); wait = 200ms) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const std::scoped_lock reading(mutex_);
    fmt::print(stderr, "\r\033[K{:.0f} s: {}", seconds, what_);
    std::fflush(stderr);
    shown = true;
  }
  if (shown) fmt::print(stderr, "\r\033[K");
}

Interrupt::Interrupt() {
  const sigset_t set = interrupts();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);  // inherited by every later thread; only the listener takes them
  listener_ = std::jthread([this, set](const std::stop_token& stop) {
    const timespec tick{0, 100'000'000};
    while (!stop.stop_requested()) {
      if (sigtimedwait(&set, nullptr, &tick) < 0) continue;
      if (!work_.request_stop()) std::_Exit(130);  // asked before: they mean it
    }
  });
}

Interrupt::~Interrupt() {
  listener_.request_stop();
  listener_.join();
  const sigset_t set = interrupts();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

std::string pipeline_cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache && *cache == '/') return std::string(cache) + "/swarmfit";
  const char* home = std::getenv("HOME");
  if (home && *home == '/') return std::string(home) + "/.cache/swarmfit";
  return {};
}

}  // namespace swarmfit::cli
