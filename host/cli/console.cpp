#include "host/cli/console.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
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

const std::string kPlain = "\033[0m";
const std::string kRed = "\033[1;31m", kGreen = "\033[32m", kYellow = "\033[33m";

/// A note that a person should not overlook.
void alarm(std::string_view message) {
  const bool colours = wants_colours(STDERR_FILENO);
  tell(fmt::format("{}swarmfit:{} {}\n", colours ? kRed.c_str() : "", colours ? kPlain.c_str() : "", on_one_line(message)));
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

void tell(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

void note(std::string_view message) { tell(fmt::format("swarmfit: {}\n", on_one_line(message))); }

int complain(const Error& error) {
  alarm(error.message);
  return exit_code(error.kind);
}

int wrong_usage(std::string_view message) {
  alarm(message);
  return kWrongUsage;
}

bool wants_colours(int descriptor) {
  const char* refused = std::getenv("NO_COLOR");
  if (refused && *refused) return false;
  const char* terminal = std::getenv("TERM");
  return ::isatty(descriptor) == 1 && terminal && *terminal && std::string_view(terminal) != "dumb";
}

std::string painted_marks(const std::string& table) {
  if (!wants_colours(STDOUT_FILENO)) return table;
  std::string out;
  for (std::size_t start = 0; start < table.size();) {
    const std::size_t end = std::min(table.find('\n', start), table.size() - 1) + 1;
    std::string line = table.substr(start, end - start);
    for (const auto& [mark, colour] : {std::pair{"  ok", kGreen}, std::pair{"  --", kYellow}, std::pair{"  NO", kRed}}) {
      if (line.starts_with(mark)) line = colour + line.substr(0, 4) + kPlain + line.substr(4);
    }
    out += line;
    start = end;
  }
  return out;
}

Progress::Progress(bool quiet) {
  if (!quiet && ::isatty(STDERR_FILENO) == 1) ticker_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Progress::~Progress() = default;

void Progress::say(std::string what) {
  const std::scoped_lock lock(mutex_);
  what_ = std::move(what);
  done_ = whole_ = 0;
  stage_ = Clock::now();
}

void Progress::step(std::string what, std::size_t done, std::size_t whole) {
  const std::scoped_lock lock(mutex_);
  what_ = std::move(what);
  done_ = done;
  whole_ = whole;
}

void Progress::within(double ms) {
  const std::scoped_lock lock(mutex_);
  constexpr double kYear = 3.2e10;  // [ms]; a clock holds no more than a few hundred of them
  if (ms > 0 && ms < kYear)
    deadline_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(ms));
}

std::string Progress::line() const {
  using Seconds = std::chrono::duration<double>;
  const auto now = Clock::now();
  std::string text = fmt::format("{:.0f} s: {}", Seconds(now - start_).count(), what_);
  std::optional<double> left;
  if (done_ > 0) {
    const double each = Seconds(now - stage_).count() / static_cast<double>(done_);
    text += each < 1 ? fmt::format(", {:.1f} a second", 1 / each) : fmt::format(", {:.1f} s each", each);
    if (whole_ > done_) left = each * static_cast<double>(whole_ - done_);
  }
  if (deadline_) {
    const double allowed = std::max(0.0, Seconds(*deadline_ - now).count());
    left = left ? std::min(*left, allowed) : allowed;
  }
  if (left) text += fmt::format(", about {:.0f} s left", std::ceil(*left));
  return text;
}

void Progress::run(const std::stop_token& stop) {
  using namespace std::chrono_literals;
  std::condition_variable_any wake;
  std::mutex asleep;
  std::unique_lock lock(asleep);
  bool shown = false;
  for (auto wait = 1000ms; !wake.wait_for(lock, stop, wait, [&] { return stop.stop_requested(); }); wait = 200ms) {
    const std::scoped_lock reading(mutex_);
    tell("\r\033[K" + line());
    shown = true;
  }
  if (shown) tell("\r\033[K");
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
