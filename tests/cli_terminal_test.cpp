// What a terminal gets: completion, the man page, the doctor, tables of 80 columns, progress, colours; and no escape codes in a pipe.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <pty.h>

#include <gtest/gtest.h>

#include "tests/cli_runner.hpp"

namespace {

using swarmfit::tests::expect_refusal;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

const std::vector<std::string> kCommands = {"fit", "perceive", "learn", "bench", "devices", "demo", "doctor", "completion"};

/// stdout and stderr of a line of bash, and how it ended.
std::pair<int, std::string> in_bash(const TemporaryFolder& folder, const std::string& script) {
  folder.put("script.sh", script);
  std::FILE* pipe = ::popen(("cd '" + folder.path().string() + "' && bash script.sh 2>&1").c_str(), "r");
  std::string out;
  char buffer[4096];
  for (std::size_t n; pipe && (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.append(buffer, n);
  return {pipe ? ::pclose(pipe) : -1, out};
}

/// Every --option that the help of a command names.
std::vector<std::string> options_of(const TemporaryFolder& folder, const std::string& command) {
  const std::string help = run_swarmfit(folder, {command, "--help"}).out;
  static const std::regex line(R"(\n +(?:-[a-z],)?(--[a-z-]+))");
  std::vector<std::string> options;
  for (std::sregex_iterator it(help.begin(), help.end(), line), end; it != end; ++it) options.push_back((*it)[1]);
  return options;
}

std::string words_offered(const TemporaryFolder& folder, const std::string& line) {
  const auto [code, out] = in_bash(folder, "source completion.bash\nCOMP_WORDS=(" + line +
                                               ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_swarmfit\necho \" ${COMPREPLY[*]} \"\n");
  EXPECT_EQ(code, 0) << out;
  return out;
}

TEST(CliTerminal, BashCompletes) {
  const TemporaryFolder folder;
  const auto script = run_swarmfit(folder, {"completion", "bash"});
  ASSERT_EQ(script.code, 0) << script.err;
  folder.put("completion.bash", script.out);
  folder.put("room.pcd", "");
  const std::string commands = words_offered(folder, "swarmfit ''");
  for (const auto& command : kCommands) {
    EXPECT_NE(commands.find(" " + command + " "), std::string::npos) << command << " in" << commands;
    const std::string offered = words_offered(folder, "swarmfit " + command + " --");
    const auto options = options_of(folder, command);
    EXPECT_FALSE(options.empty()) << command;
    for (const auto& option : options)
      EXPECT_NE(offered.find(" " + option + " "), std::string::npos) << command << " " << option << offered;
  }
  EXPECT_EQ(commands.find(" man "), std::string::npos);
  EXPECT_EQ(words_offered(folder, "swarmfit fit --preset f"), " fast \n");
  EXPECT_EQ(words_offered(folder, "swarmfit fit --seed 2 pla"), " plane \n");
  EXPECT_EQ(words_offered(folder, "swarmfit fit plane room"), " room.pcd \n");
  EXPECT_EQ(words_offered(folder, "swarmfit fit --seed ''"), "  \n");
  EXPECT_EQ(words_offered(folder, "swarmfit completion z"), " zsh \n");
}

TEST(CliTerminal, OtherShellsAreGivenEveryOption) {
  const TemporaryFolder folder;
  const std::string zsh = run_swarmfit(folder, {"completion", "zsh"}).out, fish = run_swarmfit(folder, {"completion", "fish"}).out;
  EXPECT_TRUE(zsh.starts_with("#compdef swarmfit\n"));
  for (const auto& command : kCommands) {
    EXPECT_NE(zsh.find("'" + command + ":"), std::string::npos) << command;
    EXPECT_NE(fish.find(" -a " + command + " "), std::string::npos) << command;
    for (const auto& option : options_of(folder, command)) {
      EXPECT_NE(zsh.find("'" + option + "["), std::string::npos) << option;
      EXPECT_NE(fish.find(" -l " + option.substr(2) + " "), std::string::npos) << option;
    }
  }
  folder.put("z", zsh);
  folder.put("f", fish);
  const auto [code, out] = in_bash(folder, "! command -v zsh >/dev/null || zsh -n z || exit 1; ! command -v fish >/dev/null || fish -n f");
  EXPECT_EQ(code, 0) << out;
  expect_refusal(folder, {"completion", "tcsh"}, 2, "bash, zsh, fish");
}

TEST(CliTerminal, TheManPageHasWhatTheHelpHas) {
  const TemporaryFolder folder;
  const auto page = run_swarmfit(folder, {"man"});
  ASSERT_EQ(page.code, 0) << page.err;
  EXPECT_NE(page.out.find("\n.TH SWARMFIT 1 "), std::string::npos);
  std::string plain = page.out;
  for (std::size_t at; (at = plain.find("\\-")) != std::string::npos;) plain.erase(at, 1);
  for (const auto& command : kCommands) {
    EXPECT_NE(plain.find("\n.SS swarmfit " + command + " "), std::string::npos) << command;
    for (const auto& option : options_of(folder, command)) EXPECT_NE(plain.find(option), std::string::npos) << option;
  }
  // No line is taken for a request that is none.
  static const std::regex request(R"(\n[.'](?!\\"|TH|SH|SS|TP|PP|B |I |nf|fi|sp))");
  EXPECT_FALSE(std::regex_search(page.out, request));
  folder.put("swarmfit.1", page.out);
  // Without what sanitized tests preload: man is not ours.
  const auto [code, out] = in_bash(folder,
                                   "if command -v man >/dev/null && command -v groff >/dev/null; then\n"
                                   "  MANWIDTH=80 env -u LD_PRELOAD man --warnings=w -l swarmfit.1 2>complaints >/dev/null || exit 1\n"
                                   "  cat complaints; ! [ -s complaints ]\nfi\n");
  EXPECT_EQ(code, 0) << out;
}

TEST(CliTerminal, TheDoctorSaysWhetherFitCanRun) {
  const TemporaryFolder folder;
  const auto well = run_swarmfit(folder, {"doctor", "--backend", "cpu"});
  EXPECT_EQ(well.code, 0) << well.out << well.err;
  EXPECT_EQ(well.err, "");
  for (const char* what : {"cpu takes cpu", "the 3 planes of a corner", "SIMD", "threads", "Vulkan loader", "pipeline cache", "OpenCV"})
    EXPECT_NE(well.out.find(what), std::string::npos) << what << "\n" << well.out;
  const auto ill = run_swarmfit(folder, {"doctor", "--backend", "abacus"});
  EXPECT_EQ(ill.code, 4) << ill.out;
  EXPECT_NE(ill.out.find("fit cannot run"), std::string::npos) << ill.out;
  for (const auto& outcome : {well, ill}) {
    EXPECT_EQ(outcome.out.find('\033'), std::string::npos);
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

/// What the command writes to a terminal on stderr.
std::string at_a_terminal(const TemporaryFolder& folder, const std::vector<std::string>& arguments) {
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    ::setenv("TERM", "xterm", 1);
    ::unsetenv("NO_COLOR");
    std::vector<std::string> words = {SWARMFIT_COMMAND};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (auto& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int out = ::open("/dev/null", O_WRONLY);
    if (::chdir(folder.path().c_str()) == 0 && ::dup2(out, STDOUT_FILENO) >= 0) ::execv(SWARMFIT_COMMAND, argv.data());
    ::_exit(127);
  }
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t got = 0; (got = ::read(terminal, piece.data(), piece.size())) > 0;) text.append(piece.data(), static_cast<std::size_t>(got));
  ::waitpid(child, nullptr, 0);
  ::close(terminal);
  return text;
}

TEST(CliTerminal, WhatTakesLongIsToldOnATerminal) {
  const TemporaryFolder folder;
  std::string points;
  for (int i = 0; i < 400; ++i) points += std::to_string(0.05 * (i % 20)) + " " + std::to_string(0.05 * (i / 20)) + " 0\n";
  folder.put("c.xyz", points);
  std::vector<std::string> endless = {"fit",       "plane",   "c.xyz",     "--backend",     "cpu", "--iterations",
                                      "100000000", "--stall", "100000000", "--time-budget", "2500"};
  const std::string told = at_a_terminal(folder, endless);
  EXPECT_TRUE(std::regex_search(told, std::regex("[0-9] s: .*about [0-9]+ s left"))) << told;
  EXPECT_TRUE(told.ends_with("\r\033[K")) << told;  // and taken away again
  endless.emplace_back("--quiet");
  EXPECT_EQ(at_a_terminal(folder, endless), "");
  EXPECT_NE(at_a_terminal(folder, {"fit", "blob", "c.xyz"}).find("\033["), std::string::npos);
}

TEST(CliTerminal, VerboseTellsOnStderrAndAPipeGetsNoColours) {
  const TemporaryFolder folder;
  std::string points;
  for (int i = 0; i < 400; ++i) points += std::to_string(0.05 * (i % 20)) + " " + std::to_string(0.05 * (i / 20)) + " 0\n";
  folder.put("c.xyz", points);
  const auto outcome = run_swarmfit(folder, {"fit", "plane", "c.xyz", "--verbose", "--quiet", "--backend", "cpu"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  for (const char* what : {"back end   cpu on", "threshold  0.01", "model 1", "round", "times      back end"})
    EXPECT_NE(outcome.err.find(what), std::string::npos) << what << "\n" << outcome.err;
  const auto plain = run_swarmfit(folder, {"fit", "plane", "c.xyz"}), wrong = run_swarmfit(folder, {"fit", "blob", "c.xyz"});
  for (const auto& text : {outcome.err, plain.out, plain.err, wrong.err}) EXPECT_EQ(text.find('\033'), std::string::npos) << text;
}

TEST(CliTerminal, SummariesFit80Columns) {
  const TemporaryFolder folder;
  std::string points;
  for (int i = 0; i < 400; ++i) points += std::to_string(0.05 * (i % 20)) + " " + std::to_string(0.05 * (i / 20)) + " 0\n";
  folder.put("c.xyz", points);
  const std::vector<std::vector<std::string>> calls = {
      {"fit", "plane", "c.xyz"}, {"fit", "plane", "c.xyz", "--backend", "cpu"}, {"perceive", "c.xyz", "--gravity", "0,0,-1"}};
  for (const auto& call : calls) {
    const auto outcome = run_swarmfit(folder, call);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("\nstopped: "), std::string::npos) << outcome.out;
    std::istringstream lines(outcome.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
}

}  // namespace
