// The command does its work: files hold what design says, and equal seeds give equal bytes.
#include <random>
#include <regex>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/cli_runner.hpp"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using swarmfit::tests::contents;
using swarmfit::tests::data_folder;
using swarmfit::tests::Outcome;
using swarmfit::tests::run_swarmfit;
using swarmfit::tests::TemporaryFolder;

/// Two planes, z = 1 and x = 2, each of 400 points, and 100 points anywhere.
std::string two_planes() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 2), noise(-0.002, 0.002);
  std::string text;
  for (int i = 0; i < 900; ++i) {
    const double a = place(random), b = place(random), c = i < 800 ? noise(random) : place(random);
    const double x = i < 400 ? a : i < 800 ? 2 + c : a, y = b, z = i < 400 ? 1 + c : i < 800 ? a : c;
    text += std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  }
  return text;
}

std::string without_times(const std::string& text) {
  static const std::regex times(R"re("(found_at_ms|total|load|fit|popout|segment|recognise)":[-+.e0-9]+)re");
  return std::regex_replace(text, times, "\"$1\":0");
}

/// Debian's python3-skimage brings the pair.
TEST(CliDemo, TheMotorcycleSticksOutOfTheFloor) {
  if (!fs::exists("/usr/lib/python3/dist-packages/skimage/data/motorcycle_left.png")) GTEST_SKIP() << "python3-skimage is not installed";
  const TemporaryFolder folder;
  const Outcome outcome = run_swarmfit(folder, {"demo", "--motorcycle", "--out", "out", "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const cv::Mat popout = cv::imread((folder / "out/popout.png").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat planes = cv::imread((folder / "out/planes.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_FALSE(popout.empty() || planes.empty());
  // Its rear wheel, its engine and its front wheel, all taller together than a thing on a table.
  for (const cv::Rect part : {cv::Rect(130, 290, 60, 60), cv::Rect(340, 300, 50, 50), cv::Rect(600, 320, 50, 60)})
    EXPECT_GT(cv::countNonZero(popout(part)), part.area() / 2) << part.x;
  // Its saddle is level: something may stand on it.
  const cv::Rect saddle(200, 180, 60, 30);
  const cv::Mat surface = planes(saddle) > 0, floor = planes(saddle) == planes.at<std::uint16_t>(460, 200);
  EXPECT_GT(cv::countNonZero((popout(saddle) > 0) | (surface & ~floor)), saddle.area() / 2);
}

TEST(CliFit, FindsBothPlanesAndWritesWhatItSays) {
  const TemporaryFolder folder;
  folder.put("c.xyz", two_planes());
  const Outcome outcome =
      run_swarmfit(folder, {"fit", "plane", "c.xyz", "--json", "r.json", "--labels", "l.txt", "--out", "out", "--threads", "1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("2 models"), std::string::npos) << outcome.out;
  const json j = json::parse(contents(folder / "r.json"));
  ASSERT_EQ(j["models"].size(), 2U);
  EXPECT_EQ(j["input"]["points"], 900);
  const std::string labels = contents(folder / "l.txt");
  EXPECT_EQ(std::count(labels.begin(), labels.end(), '\n'), 900);
  EXPECT_EQ(contents(folder / "out/labels.txt"), labels);

  const Outcome again = run_swarmfit(folder, {"fit", "plane", "c.xyz", "--json", "s.json", "--threads", "2", "--quiet"});
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(again.out + again.err, "");
  EXPECT_EQ(without_times(contents(folder / "r.json")), without_times(contents(folder / "s.json")));
}

TEST(CliFit, OnlyWithinAnAngleOfADirection) {
  const TemporaryFolder folder;
  folder.put("c.xyz", two_planes());
  const Outcome outcome = run_swarmfit(folder, {"fit", "plane", "c.xyz", "--normal", "-1,0,0", "--within", "10", "--json", "r.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json j = json::parse(contents(folder / "r.json"));
  ASSERT_EQ(j["models"].size(), 1U);
  EXPECT_GT(std::abs(j["models"][0]["parameters"]["normal"][0].get<double>()), 0.99);
}

TEST(CliFit, ADepthImage) {
  const TemporaryFolder folder;
  cv::Mat depth(60, 80, CV_16U, cv::Scalar::all(1000));
  cv::imwrite((folder / "d.png").string(), depth);
  const Outcome outcome =
      run_swarmfit(folder, {"fit", "plane", "d.png", "--intrinsics", "80,80,40,30", "--depth-scale", "0.002", "--json", "r.json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json j = json::parse(contents(folder / "r.json"));
  ASSERT_GE(j["models"].size(), 1U);
  EXPECT_NEAR(std::abs(j["models"][0]["parameters"]["offset"].get<double>()), 2.0, 1e-3);
  EXPECT_EQ(j["input"]["width"], 80);
}

TEST(CliFit, CollinearPointsAreAnswered) {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 200; ++i) text += std::to_string(i * 0.01) + " " + std::to_string(i * 0.02) + " 1\n";
  folder.put("line.xyz", text);
  const Outcome outcome = run_swarmfit(folder, {"fit", "plane", "line.xyz", "--json", "r.json"});
  EXPECT_TRUE(outcome.code == 0 || outcome.code == 3) << outcome.code << outcome.err;
  EXPECT_EQ(fs::exists(folder / "r.json"), outcome.code == 0);
}

TEST(CliDemo, ShowsTheTruthBesideWhatWasFound) {
  const TemporaryFolder folder;
  const Outcome outcome = run_swarmfit(folder, {"demo"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("surface  normal"), std::string::npos);
  EXPECT_NE(outcome.out.find("object  kind"), std::string::npos);
  std::istringstream lines(outcome.out.substr(outcome.out.find("surface  normal")));
  for (std::string line; std::getline(lines, line);) {
    if (line.find(", -0.866,") == std::string::npos) continue;
    EXPECT_LE(line.size(), 80U) << line;
    EXPECT_TRUE(line.ends_with(" %")) << "a surface's row is one line: " << line;
  }
  for (const char* name : {"result.json", "planes.png", "popout.png", "objects.png", "overlay.png"}) {
    EXPECT_TRUE(fs::is_regular_file(folder / "swarmfit-demo" / name)) << name;
  }
  const json j = json::parse(contents(folder / "swarmfit-demo/result.json"));
  EXPECT_GT(j["sois"].size(), 0U);
  const cv::Mat objects = cv::imread((folder / "swarmfit-demo/objects.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(objects.type(), CV_16UC1);
  EXPECT_EQ(objects.cols, j["input"]["width"].get<int>());
}

TEST(CliPerceive, ACloudWithoutAGrid) {
  const TemporaryFolder folder;
  folder.put("c.xyz", two_planes());
  const Outcome outcome = run_swarmfit(folder, {"perceive", "c.xyz", "--gravity", "0,0,-1", "--out", "out", "--labels", "l.txt"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::is_regular_file(folder / "out/labelled.ply"));
  EXPECT_FALSE(fs::exists(folder / "out/planes.png"));
}

TEST(CliDevices, NamesTheBackEnds) {
  const TemporaryFolder folder;
  const Outcome outcome = run_swarmfit(folder, {"devices"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.out.find("cpu"), std::string::npos);
  EXPECT_NE(outcome.out.find("reference"), std::string::npos);
}

TEST(CliInterrupt, ReportsWhatWasFoundSoFar) {
  const TemporaryFolder folder;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 2);
  std::string text;
  for (int i = 0; i < 200000; ++i)
    text += std::to_string(place(random)) + " " + std::to_string(place(random)) + " " + std::to_string(place(random)) + "\n";
  folder.put("noise.xyz", text);
  // The slow back end and a large swarm: it would go on for minutes.
  const Outcome outcome = run_swarmfit(folder,
                                       {"fit", "plane", "noise.xyz", "--backend", "reference", "--particles", "4000", "--iterations",
                                        "100000", "--stall", "100000", "--json", "r.json", "--quiet"},
                                       std::chrono::milliseconds(1500));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json::parse(contents(folder / "r.json"))["stop_reason"], "cancelled");
}

class CliRealData : public testing::Test {
 protected:
  void SetUp() override {
    if (data_folder().empty()) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set: no real data to read";
  }
};

TEST_F(CliRealData, EveryCloudIsPerceived) {
  const TemporaryFolder folder;
  std::size_t seen = 0;
  for (const char* sub : {"mosd", "clouds"}) {
    for (const auto& entry : fs::directory_iterator(data_folder() / sub)) {
      const Outcome outcome = run_swarmfit(folder, {"perceive", entry.path().string(), "--out", "out"});
      EXPECT_EQ(outcome.code, 0) << entry.path() << outcome.err;
      ++seen;
    }
  }
  EXPECT_GT(seen, 0U);
}

TEST_F(CliRealData, EveryStereoPairAndRgbdFrame) {
  const TemporaryFolder folder;
  for (const auto& entry : fs::directory_iterator(data_folder() / "middlebury")) {
    const auto p = [&](const char* name) { return (entry.path() / name).string(); };
    const Outcome outcome =
        run_swarmfit(folder, {"perceive", "--left", p("im0.png"), "--right", p("im1.png"), "--calib", p("calib.txt"), "--out", "out"});
    EXPECT_EQ(outcome.code, 0) << entry.path() << outcome.err;
  }
  for (int i = 0; i < 6; ++i) {
    const std::string stem = (data_folder() / "rgbd" / std::to_string(i)).string();
    const Outcome outcome =
        run_swarmfit(folder, {"perceive", "--color", stem + ".color.png", "--depth", stem + ".depth.png", "--intrinsics",
                              "612.937,613.173,322.549,248.158", "--depth-scale", "0.001", "--out", "out"});
    EXPECT_EQ(outcome.code, 0) << stem << outcome.err;
  }
}

}  // namespace
