// Runs the command itself and catches what it says.
#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/io_files.hpp"

extern char** environ;

namespace swarmfit::tests {

struct Outcome {
  int code = -1;  ///< exit code; -1: it did not exit by itself
  std::string out, err;
};

/// Comes back when a child is ready for a Ctrl-C, or has ended. On a busy machine a program may take seconds to get there, and one that
/// comes before would end it.
inline void wait_until_interruptible(pid_t child) {
  const std::string status = "/proc/" + std::to_string(child) + "/status", field = "SigCgt:";
  for (int tries = 0; tries < 6000; ++tries) {
    const std::string text = contents(status);
    const std::size_t caught = text.find(field);
    if (caught == std::string::npos || text.find("State:\tZ") != std::string::npos) return;
    if ((std::stoull(text.substr(caught + field.size()), nullptr, 16) >> (SIGINT - 1) & 1U) != 0) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

/// One run of a program, words[0], in a folder of its own; `interrupt_after` that it is ready for one sends it a Ctrl-C.
inline Outcome run_program(const TemporaryFolder& folder, std::vector<std::string> words,
                           std::chrono::milliseconds interrupt_after = std::chrono::milliseconds::zero()) {
  const std::string out = folder / ".stdout", err = folder / ".stderr";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addchdir_np(&actions, folder.path().c_str());
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawn(&child, words.front().c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  Outcome outcome;
  if (failed != 0) return outcome;
  if (interrupt_after.count() > 0) {
    wait_until_interruptible(child);
    std::this_thread::sleep_for(interrupt_after);
    ::kill(child, SIGINT);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
  outcome.out = contents(out);
  outcome.err = contents(err);
  std::filesystem::remove(out);
  std::filesystem::remove(err);
  return outcome;
}

inline Outcome run_swarmfit(const TemporaryFolder& folder, const std::vector<std::string>& arguments,
                            std::chrono::milliseconds interrupt_after = std::chrono::milliseconds::zero()) {
  std::vector<std::string> words = {SWARMFIT_COMMAND};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run_program(folder, std::move(words), interrupt_after);
}

/// A line of shell, in which "$0" is the program.
inline Outcome run_shell(const TemporaryFolder& folder, const std::string& line) {
  return run_program(folder, {"/bin/sh", "-c", line, SWARMFIT_COMMAND});
}

/// The code, one line on stderr that starts with "swarmfit: " and holds `what`, nothing on stdout.
inline void expect_refusal(const TemporaryFolder& folder, const std::vector<std::string>& arguments, int code, const std::string& what) {
  std::string line = "swarmfit";
  for (const auto& argument : arguments) line += " " + argument;
  SCOPED_TRACE(line);
  const std::size_t before = folder.entries();
  const Outcome outcome = run_swarmfit(folder, arguments);
  EXPECT_EQ(outcome.code, code) << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("swarmfit: ")) << outcome.err;
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
  EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(folder.entries(), before) << "a file was left behind";
}

}  // namespace swarmfit::tests
