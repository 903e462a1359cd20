// What the command says to whoever called it: one line for an error, progress while it takes long, and Ctrl-C in the other direction.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>

#include <swarmfit/error.hpp>

namespace swarmfit::cli {

/// 0 done, 2 wrong usage, 3 input cannot be used (or output not written), 4 back end cannot be used.
enum ExitCode { kDone = 0, kWrongUsage = 2, kBadInput = 3, kNoBackend = 4 };

int exit_code(Error::Kind kind) noexcept;

/// "swarmfit: message" on stderr, on one line whatever the message holds. Gives the exit code.
int complain(const Error& error);
int wrong_usage(std::string_view message);

/// Text on stderr as it is. Where that is full or closed there is nobody to tell, and nothing is thrown.
void tell(std::string_view text);

/// "swarmfit: message" on stderr, nothing to worry about.
void note(std::string_view message);

/// May colours go there (STDOUT_FILENO, STDERR_FILENO)? On a terminal that knows them, and not where NO_COLOR is set.
bool wants_colours(int descriptor);
/// The marks of a doctor's table, "ok", "--" and "NO" at a line's start, in colour where stdout wants it.
std::string painted_marks(const std::string& table);

/// While it lives, and once a second has passed, a line on the terminal says what is being done. Silent where stderr is no terminal.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// What is being done now: "fitting, 3 planes so far".
  void say(std::string what);
  /// The same, with so many done of the whole, 0 where nobody knows it: the line shows the rate, and the time left where it can be told.
  void step(std::string what, std::size_t done, std::size_t whole = 0);
  /// From now on, no longer than this; 0: no bound.
  void within(double ms);

 private:
  using Clock = std::chrono::steady_clock;
  std::string line() const;
  void run(const std::stop_token& stop);
  std::mutex mutex_;
  std::string what_;
  std::size_t done_ = 0, whole_ = 0;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point stage_ = start_;  // since when things are counted
  std::optional<Clock::time_point> deadline_;
  std::jthread ticker_;  // last: it reads the rest
};

/// While it lives, the first Ctrl-C asks the work to stop and a second ends the program at once. One at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  std::stop_token token() const { return work_.get_token(); }

 private:
  int wake_[2] = {-1, -1};
  std::stop_source work_;
  std::jthread listener_;
};

/// Folder for compiled pipelines: swarmfit in the user's cache; empty where there is no such place.
std::string pipeline_cache_folder();

/// Milliseconds since it was made.
class Stopwatch {
 public:
  double ms() const { return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace swarmfit::cli
