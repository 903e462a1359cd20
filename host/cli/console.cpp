#include "host/cli/console.hpp"

#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include <fcntl.h>
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

/// A stop source may not be touched in a signal handler, a pipe may: a thread waits at its other end.
constexpr char kStop = 1;
volatile std::sig_atomic_t wake_end = -1;
volatile std::sig_atomic_t asked = 0;

extern "C" void on_interrupt(int) {
  if (asked) std::_Exit(130);  // asked before: they mean it
  asked = 1;
  const int saved = errno;
  [[maybe_unused]] const auto written = ::write(wake_end, &kStop, 1);
  errno = saved;
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
  if (::pipe2(wake_, O_CLOEXEC) != 0) return;  // then Ctrl-C ends the program, as it would have
  wake_end = wake_[1];
  asked = 0;
  listener_ = std::jthread([this] {
    char byte = 0;
    while (::read(wake_[0], &byte, 1) < 0 && errno == EINTR) {
    }
    if (byte == kStop) work_.request_stop();
  });
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Interrupt::~Interrupt() {
  if (!listener_.joinable()) return;
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  const char bye = 0;
  [[maybe_unused]] const auto written = ::write(wake_[1], &bye, 1);
  listener_.join();
  ::close(wake_[0]);
  ::close(wake_[1]);
}

std::string pipeline_cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache && *cache == '/') return std::string(cache) + "/swarmfit";
  const char* home = std::getenv("HOME");
  if (home && *home == '/') return std::string(home) + "/.cache/swarmfit";
  return {};
}

}  // namespace swarmfit::cli
