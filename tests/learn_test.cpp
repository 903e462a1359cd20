// The command learns views into a gallery on disk, and knows them again.
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli_runner.hpp"

namespace {

namespace fs = std::filesystem;
using swarmfit::tests::contents;
using swarmfit::tests::data_folder;
using swarmfit::tests::expect_refusal;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

TEST(CliLearn, RefusesWhatCannotBeLearntAndLeavesNoGalleryBehind) {
  const TemporaryFolder folder;
  folder.put("broken.png", "no picture");
  folder.put("c.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 1 0\n0 2 0\n");
  expect_refusal(folder, {"learn"}, 2, "name");
  expect_refusal(folder, {"learn", "mug"}, 2, "one of");
  expect_refusal(folder, {"learn", "mug", "broken.png"}, 3, "broken.png");
  expect_refusal(folder, {"learn", "mug", "none.png"}, 3, "none.png");
  expect_refusal(folder, {"learn", "mug", "c.xyz"}, 3, "");
  expect_refusal(folder, {"learn", "mug", "c.xyz", "--object", "0"}, 2, "--object");
  expect_refusal(folder, {"learn", "mug", "broken.png", "--object", "1"}, 2, "--object");
}

std::vector<std::string> frame(int k) {
  const std::string stem = (data_folder() / "rgbd" / std::to_string(k)).string();
  return {"--color", stem + ".color.png", "--depth", stem + ".depth.png", "--intrinsics", "612.937,613.173,322.549,248.158"};
}

TEST(CliLearn, WhatIsLearntInOneFrameIsKnownWhereItStandsAndNowhereElse) {
  if (data_folder().empty()) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set: no real data to read";
  const TemporaryFolder folder;
  std::vector<std::string> learn = {"learn", "thing", "--gallery", "g"};
  const auto two = frame(2);
  learn.insert(learn.end(), two.begin(), two.end());
  const auto learnt = run_swarmfit(folder, learn);
  ASSERT_EQ(learnt.code, 0) << learnt.err;
  EXPECT_TRUE(fs::is_regular_file(folder / "g/thing/001.png"));
  const std::string index = contents(folder / "g/features.index");
  ASSERT_FALSE(index.empty());
  const auto named = [&](int k) {
    std::vector<std::string> arguments = {"perceive", "--gallery", "g", "--json", "r.json", "--quiet"};
    const auto rest = frame(k);
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    const auto outcome = run_swarmfit(folder, arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const auto result = nlohmann::json::parse(contents(folder / "r.json"));
    return std::count_if(result["sois"].begin(), result["sois"].end(), [](const auto& soi) { return !soi["recognised"].empty(); });
  };
  for (const int k : {0, 1, 3}) EXPECT_EQ(named(k), 1) << k;  // the box stands there, too
  for (const int k : {4, 5}) EXPECT_EQ(named(k), 0) << k;
  folder.put("g/features.index", index.substr(0, index.size() / 2));  // damaged: found anew
  EXPECT_EQ(named(3), 1);
}

}  // namespace
