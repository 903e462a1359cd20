// The paper's figures: whole files, the same for the same seed, and nothing left where they cannot be written.
#include <gtest/gtest.h>

#include "tests/cli_runner.hpp"

namespace {

namespace fs = std::filesystem;
using swarmfit::tests::contents;
using swarmfit::tests::expect_refusal;
using swarmfit::tests::Outcome;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

const char* const kFiles[] = {"fig2-flight.svg", "fig3-global-best.svg", "fig6-iterations.svg", "fig7-several-lines.svg"};
const char* const kPictures[] = {"fig4-planes.jpg", "fig5-segmentation.jpg", "fixation.jpg"};

TEST(CliFigures, AreWholeAndFollowFromTheSeed) {
  const TemporaryFolder folder;
  const Outcome outcome = run_swarmfit(folder, {"figures", "--out", "a/b", "--seed", "3"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  ASSERT_EQ(run_swarmfit(folder, {"figures", "--out", "again", "--seed", "3", "--quiet"}).code, 0);
  ASSERT_EQ(run_swarmfit(folder, {"figures", "--out", "other", "--seed", "4", "--quiet"}).code, 0);
  for (const char* file : kFiles) {
    const std::string svg = contents(folder / "a/b" / file);
    EXPECT_TRUE(svg.starts_with("<svg xmlns=")) << file;
    EXPECT_TRUE(svg.ends_with("</svg>\n")) << file;
    EXPECT_EQ(svg.find("nan"), std::string::npos) << file;
    EXPECT_EQ(svg.find("inf\""), std::string::npos) << file;
    EXPECT_LT(svg.size(), 600000U) << file;
    EXPECT_NE(outcome.out.find(file), std::string::npos) << outcome.out;
    EXPECT_EQ(svg, contents(folder / "again" / file)) << file;
    EXPECT_NE(svg, contents(folder / "other" / file)) << file;
  }
  for (const char* file : kPictures) {
    const std::string jpeg = contents(folder / "a/b" / file);
    EXPECT_TRUE(jpeg.starts_with("\xff\xd8\xff")) << file;
    EXPECT_TRUE(jpeg.ends_with("\xff\xd9")) << file;
    EXPECT_LT(jpeg.size(), 200000U) << file;
    EXPECT_NE(outcome.out.find(file), std::string::npos) << outcome.out;
    EXPECT_EQ(jpeg, contents(folder / "again" / file)) << file;
    EXPECT_NE(jpeg, contents(folder / "other" / file)) << file;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a/b"), fs::directory_iterator()), 7);
}

TEST(CliFigures, RefusedBeforeAnyWork) {
  const TemporaryFolder folder;
  folder.put("file", "");
  folder.put("c.xyz", "0 0 1\n1 0 1\n0 1 1\n");
  expect_refusal(folder, {"figures"}, 2, "--out");
  expect_refusal(folder, {"figures", "--out", "f", "--seed", "-1"}, 2, "--seed");
  expect_refusal(folder, {"figures", "--out", "f", "more"}, 2, "more");
  expect_refusal(folder, {"figures", "--out", "f", "--frame", "none.pcd"}, 3, "none.pcd");
  expect_refusal(folder, {"figures", "--out", "f", "--frame", "c.xyz"}, 3, "no image grid");
  expect_refusal(folder, {"figures", "--out", ""}, 2, "empty");
  expect_refusal(folder, {"figures", "--out", "file"}, 3, "not a folder");
  expect_refusal(folder, {"figures", "--out", "file/below"}, 3, "not a folder");
  expect_refusal(folder, {"figures", "--out", "/proc/figures"}, 3, "/proc/figures");
}

}  // namespace
