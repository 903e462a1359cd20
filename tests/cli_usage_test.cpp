// Wrong usage is answered with one line and exit code 2, help and version with 0.
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/cli_runner.hpp"

namespace {

using swarmfit::tests::expect_refusal;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

TEST(CliUsage, HelpAndVersion) {
  const TemporaryFolder folder;
  const auto help = run_swarmfit(folder, {"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* word : {"fit", "perceive", "bench", "devices", "demo", "figures", "Exit codes", "metres"})
    EXPECT_NE(help.out.find(word), std::string::npos) << word;
  for (const char* sub : {"fit", "perceive", "learn", "bench", "devices", "demo", "figures"}) {
    const auto sub_help = run_swarmfit(folder, {sub, "--help"});
    EXPECT_EQ(sub_help.code, 0) << sub;
    EXPECT_EQ(sub_help.err, "") << sub;
  }
  const auto fit_help = run_swarmfit(folder, {"fit", "--help"});
  for (const char* option : {"--threshold", "--backend",   "--threads", "--seed",        "--preset",     "--particles",   "--iterations",
                             "--stall",     "--deflation", "--lambda",  "--min-inliers", "--max-models", "--time-budget", "--json",
                             "--labels",    "--out",       "--quiet",   "--normal",      "--within",     "plane",         "line2d"}) {
    EXPECT_NE(fit_help.out.find(option), std::string::npos) << option;
  }
  EXPECT_TRUE(run_swarmfit(folder, {"--version"}).out.starts_with("swarmfit 0."));
}

/// Help with its line ends and indentation as single spaces.
std::string in_one_line(const std::string& help) {
  std::istringstream words(help);
  std::string line;
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

// What help calls the default is what a fit without the option takes.
TEST(CliUsage, HelpNamesTheThresholdThatIsTaken) {
  const TemporaryFolder folder;
  std::string space, pairs;
  for (int i = 0; i < 60; ++i) {
    const std::string x = std::to_string((i * 37) % 61), y = std::to_string((i * 53) % 59), z = std::to_string((i * 29) % 47);
    space += x + "," + y + "," + z + "\n";
    pairs += x + "," + y + "," + y + "," + z + "\n";
  }
  folder.put("space.csv", space);
  folder.put("pairs.csv", pairs);
  const std::string help = in_one_line(run_swarmfit(folder, {"fit", "--help"}).out);
  EXPECT_NE(help.find("[plane, sphere, cylinder: 0.01; homography: 6; fundamental: 2.5; line2d, circle2d, --noise depth: auto]"),
            std::string::npos);
  const std::pair<const char*, const char*> taken[] = {
      {"plane", "0.01"}, {"sphere", "0.01"}, {"cylinder", "0.01"}, {"homography", "6"}, {"fundamental", "2.5"}};
  for (const auto& [model, threshold] : taken) {
    const bool of_pairs = model == std::string("homography") || model == std::string("fundamental");
    const auto outcome = run_swarmfit(folder, {"fit", model, of_pairs ? "pairs.csv" : "space.csv", "--max-models", "1"});
    ASSERT_EQ(outcome.code, 0) << model << outcome.err;
    EXPECT_NE(outcome.out.find("threshold " + std::string(threshold) + "\n"), std::string::npos) << model << outcome.out;
  }
  EXPECT_NE(in_one_line(run_swarmfit(folder, {"perceive", "--help"}).out).find("[0.01; a stereo pair: 0.015]"), std::string::npos);
}

TEST(CliUsage, HelpFitsEightyColumns) {
  const TemporaryFolder folder;
  for (const auto& command : std::vector<std::vector<std::string>>{
           {}, {"fit"}, {"perceive"}, {"learn"}, {"bench"}, {"devices"}, {"demo"}, {"figures"}, {"doctor"}, {"completion"}, {"man"}}) {
    std::vector<std::string> words = command;
    words.emplace_back("--help");
    std::istringstream lines(run_swarmfit(folder, words).out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
  }
  // A command that is too long goes on as a shell reads it.
  EXPECT_NE(run_swarmfit(folder, {"perceive", "--help"}).out.find(" \\\n      "), std::string::npos);
}

TEST(CliUsage, UnknownWords) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  expect_refusal(folder, {}, 2, "no subcommand");
  expect_refusal(folder, {"frobnicate"}, 2, "frobnicate");
  expect_refusal(folder, {"--frobnicate"}, 2, "frobnicate");
  expect_refusal(folder, {"fit"}, 2, "model");
  expect_refusal(folder, {"fit", "plane"}, 2, "input");
  expect_refusal(folder, {"fit", "blob", "c.xyz"}, 2, "blob");
  expect_refusal(folder, {"fit", "plane,blob", "c.xyz"}, 2, "blob");
  expect_refusal(folder, {"fit", "plane,line2d", "c.xyz"}, 2, "line2d");
  expect_refusal(folder, {"fit", "plane,plane", "c.xyz"}, 2, "once");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--model", "sphere"}, 2, "--model");
  expect_refusal(folder, {"fit", "--model", "sphere"}, 2, "input");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--frobnicate"}, 2, "--frobnicate");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "more"}, 2, "more");
  expect_refusal(folder, {"devices", "more"}, 2, "more");
}

TEST(CliUsage, ValuesOutOfTheirBounds) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  for (const char* option : {"--threshold", "--lambda", "--time-budget"}) {
    for (const char* value : {"0", "-1", "nan", "inf", "much"}) expect_refusal(folder, {"fit", "plane", "c.xyz", option, value}, 2, option);
  }
  for (const char* value : {"1e-31", "1e-300", "1e31", "1e300"})  // no float holds them, or not what many points add up to
    expect_refusal(folder, {"fit", "plane", "c.xyz", "--threshold", value}, 2, "--threshold: " + std::string(value) + ", must be in ");
  for (const char* option : {"--particles", "--iterations", "--stall", "--min-inliers", "--max-models"}) {
    for (const char* value : {"0", "-1", "nan", "1.5", "99999999999999999999"})
      expect_refusal(folder, {"fit", "plane", "c.xyz", option, value}, 2, option);
  }
  for (const char* value : {"-1", "nan", "x"}) {
    expect_refusal(folder, {"fit", "plane", "c.xyz", "--threads", value}, 2, "--threads");
    expect_refusal(folder, {"fit", "plane", "c.xyz", "--seed", value}, 2, "--seed");
  }
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--preset", "slow"}, 2, "--preset");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--deflation", "none"}, 2, "--deflation");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--normal", "0,0,0"}, 2, "--normal");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--normal", "0,1"}, 2, "--normal");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--within", "10"}, 2, "--normal");
  expect_refusal(folder, {"fit", "plane", "c.xyz", "--normal", "0,0,1", "--within", "0"}, 2, "--within");
  expect_refusal(folder, {"fit", "plane", "d.png"}, 2, "--intrinsics");
  expect_refusal(folder, {"fit", "plane", "d.png", "--intrinsics", "1,2,3"}, 2, "--intrinsics");
  expect_refusal(folder, {"fit", "plane", "d.png", "--intrinsics", "0,2,3,4"}, 2, "--intrinsics");
  expect_refusal(folder, {"fit", "plane", "d.png", "--intrinsics", "1,2,3,4", "--depth-scale", "0"}, 2, "--depth-scale");
  for (const char* option : {"--points", "--particles", "--seconds", "--threads", "--pruning", "--model"}) {
    expect_refusal(folder, {"bench", option, "-1"}, 2, option == std::string("--model") ? "-1" : option);
  }
}

TEST(CliUsage, WhereAnOptionIsGivenSoIsItsValue) {
  const TemporaryFolder folder;
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  for (const char* option : {"--threshold", "--backend", "--threads", "--seed", "--particles", "--max-models", "--json", "--labels",
                             "--out", "--report", "--gravity", "--normal", "--intrinsics"}) {
    expect_refusal(folder, {"fit", "plane", "c.xyz", option, ""}, 2, std::string(option) + ": empty, must be ");
    expect_refusal(folder, {"fit", "plane", "c.xyz", std::string(option) + "="}, 2, option);
  }
  expect_refusal(folder, {"fit", "", "c.xyz"}, 2, "model: empty, must be MODEL");
  expect_refusal(folder, {"perceive", "c.xyz", "--gallery", ""}, 2, "--gallery: empty, must be DIR");
  expect_refusal(folder, {"perceive", "c.xyz", ""}, 2, "input: empty, must be INPUT");
  expect_refusal(folder, {"bench", "--json", ""}, 2, "--json: empty, must be FILE");
  expect_refusal(folder, {"demo", "--frames", ""}, 2, "--frames: empty, must be N");
}

TEST(CliUsage, ABenchTakesWholeNumbersAndNames) {
  const TemporaryFolder folder;
  expect_refusal(folder, {"bench", "--seed", "1.5"}, 2, "--seed: 1.5, must be a whole number");
  expect_refusal(folder, {"bench", "--threads", "1.5"}, 2, "--threads: 1.5, must be a whole number");
  expect_refusal(folder, {"bench", "--model", ","}, 2, "--model: ,, must be");
  expect_refusal(folder, {"bench", "--backend", ","}, 2, "--backend: ,, must be");
}

TEST(CliUsage, PerceiveTakesOneKindOfInput) {
  const TemporaryFolder folder;
  expect_refusal(folder, {"perceive"}, 2, "one of");
  expect_refusal(folder, {"perceive", "c.pcd", "--left", "l.png"}, 2, "one of");
  expect_refusal(folder, {"perceive", "--left", "l.png", "--right", "r.png"}, 2, "--calib");
  expect_refusal(folder, {"perceive", "--color", "c.png", "--intrinsics", "1,1,1,1"}, 2, "--depth");
  expect_refusal(folder, {"perceive", "--color", "c.png", "--depth", "d.png"}, 2, "--intrinsics");
  for (const char* value : {"", "grabcut", "Fixation"})
    expect_refusal(folder, {"perceive", "c.pcd", "--segmentation", value}, 2, "--segmentation");
  expect_refusal(folder, {"perceive", "c.pcd", "--gravity", "0,0,0"}, 2, "--gravity");
  expect_refusal(folder, {"perceive", "c.pcd", "--gravity", "0,nan,0"}, 2, "--gravity");
  expect_refusal(folder, {"perceive", "c.pcd", "--camera-tilt", "91"}, 2, "--camera-tilt");
  expect_refusal(folder, {"perceive", "c.pcd", "--camera-tilt", "nan"}, 2, "--camera-tilt");
  expect_refusal(folder, {"perceive", "c.pcd", "--camera-tilt", "1", "--gravity", "0,1,0"}, 2, "exclude");
  for (const char* value : {"0", "-1", "nan", "inf", "1e-30", "1e30"})
    expect_refusal(folder, {"perceive", "c.pcd", "d.pcd", "--fps", value}, 2, "--fps: ");
}

}  // namespace
