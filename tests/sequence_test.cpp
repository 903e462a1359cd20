// Frames that follow each other: identities over frames, planes that seed the next search, and the command's lines, frame by frame.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <swarmfit/perception.hpp>
#include <swarmfit/results.hpp>
#include <swarmfit/scene.hpp>

#include "host/perception/assignment.hpp"
#include "host/perception/tracking.hpp"
#include "tests/cli_runner.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using perception::assign;
using perception::Tracker;
using tests::contents;
using tests::expect_refusal;
using tests::raw;
using tests::run_swarmfit;
using tests::TemporaryFolder;

TEST(Assignment, TakesTheLeastSumAndLeavesAloneWhatCostsTooMuch) {
  // Each by itself would take column 0; together they cost least crosswise.
  EXPECT_EQ(assign({1, 2, 1.1, 9}, 2, 5), (std::vector<int>{1, 0}));
  EXPECT_EQ(assign({6, 7, 1, 9}, 2, 5), (std::vector<int>{-1, 0}));
  EXPECT_EQ(assign({1, 2, 3}, 1, 5), (std::vector<int>{0, -1, -1}));
  EXPECT_EQ(assign({3, 1, 2}, 3, 5), (std::vector<int>{1}));
  EXPECT_TRUE(assign({}, 0, 5).empty());
  const double never = std::numeric_limits<double>::infinity();
  EXPECT_EQ(assign({never, 1, never, never}, 2, 5), (std::vector<int>{1, -1}));
}

TEST(Assignment, AsGoodAsEveryOrderTried) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<double> costs(20);
    for (double& c : costs) c = static_cast<double>(random() % 1000) / 100;
    const auto chosen = assign(costs, 5, 6);
    double sum = 0;
    for (std::size_t r = 0; r < 4; ++r) sum += chosen[r] < 0 ? 6 : costs[r * 5 + static_cast<std::size_t>(chosen[r])];
    std::vector<int> order = {0, 1, 2, 3, 4};
    double least = 24;
    do {
      double tried = 0;
      for (std::size_t r = 0; r < 4; ++r) tried += std::min(6.0, costs[r * 5 + static_cast<std::size_t>(order[r])]);
      least = std::min(least, tried);
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_NEAR(sum, least, 1e-9) << seed;
  }
}

/// Spaces at these places, all of one size, over a table.
PerceiveResult view(const std::vector<Eigen::Vector3d>& centres, double radius = 0.06) {
  PerceiveResult frame;
  frame.up = -Eigen::Vector3d::UnitY();
  Model table;
  table.parameters = Eigen::Vector4d(0, -1, 0, 0.8);
  frame.fit.models = {table};
  for (const auto& centre : centres) {
    SpaceOfInterest soi;
    soi.centre = centre;
    soi.radius = radius;
    frame.sois.push_back(soi);
  }
  return frame;
}

std::vector<std::uint64_t> ids(const PerceiveResult& frame) {
  std::vector<std::uint64_t> all;
  for (const auto& soi : frame.sois) all.push_back(soi.id);
  return all;
}

using Ids = std::vector<std::uint64_t>;

TEST(Tracker, AThingKeepsItsIdWhereverItIsInTheList) {
  Tracker tracker;
  auto frame = view({{0, 0.7, 1}, {0.3, 0.7, 1}, {-0.3, 0.7, 1.2}});
  tracker.follow(frame);
  EXPECT_EQ(ids(frame), (Ids{1, 2, 3}));
  frame = view({{-0.31, 0.7, 1.2}, {0.01, 0.7, 1}, {0.29, 0.71, 1}});
  tracker.follow(frame);
  EXPECT_EQ(ids(frame), (Ids{3, 1, 2}));
  EXPECT_EQ(frame.fit.models[0].id, 1U);
}

TEST(Tracker, OutOfSightForAWhileItComesBackAndANewcomerGetsANewId) {
  Tracker tracker;
  auto frame = view({{0, 0.7, 1}, {0.3, 0.7, 1}});
  tracker.follow(frame);
  for (int i = 0; i < 20; ++i) {
    frame = view({{0, 0.7, 1}});
    tracker.follow(frame);
  }
  frame = view({{0.31, 0.7, 1}, {0, 0.7, 1}, {0.6, 0.7, 1}});
  tracker.follow(frame);
  EXPECT_EQ(ids(frame), (Ids{2, 1, 3}));
}

TEST(Tracker, AnIdIsNeverGivenTwice) {
  Tracker tracker;
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 300; ++i) {
    auto frame = view({{0.5 * i, 0.7, 1}});  // each time somewhere else
    tracker.follow(frame);
    EXPECT_TRUE(seen.insert(frame.sois[0].id).second) << i;
  }
}

TEST(Tracker, ThingsOfAnotherSizeAreOthers) {
  Tracker tracker;
  auto frame = view({{0, 0.7, 1}}, 0.04);
  tracker.follow(frame);
  frame = view({{0, 0.7, 1}}, 0.15);
  tracker.follow(frame);
  EXPECT_EQ(ids(frame), (Ids{2}));
}

TEST(Tracker, ACameraThatTurnsSteadilyMovesEverything) {
  Tracker tracker;
  const std::vector<Eigen::Vector3d> things = {{-0.4, 0.7, 1.0}, {-0.2, 0.7, 1.4}, {0, 0.7, 1.1}, {0.2, 0.7, 1.5}, {0.4, 0.7, 1.2}};
  // Faster and faster: in the end by more in a frame than lies between two things' gates.
  double angle = 0, speed = 0;
  for (int i = 0; i < 40; ++i) {
    angle += speed;
    speed = std::min(0.14, speed + 0.01);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, -Eigen::Vector3d::UnitY()).toRotationMatrix();
    std::vector<Eigen::Vector3d> seen;
    for (const auto& thing : things) seen.emplace_back(turn * thing);
    auto frame = view(seen);
    tracker.follow(frame);
    EXPECT_EQ(ids(frame), (Ids{1, 2, 3, 4, 5})) << i;
  }
}

TEST(Tracker, PlanesKeepTheirIdsAndSeedTheNextSearch) {
  Tracker tracker;
  auto frame = view({});
  Model floor = frame.fit.models[0];
  floor.parameters[3] = 1.5;
  frame.fit.models.push_back(floor);
  tracker.follow(frame);
  EXPECT_EQ(frame.fit.models[1].id, 2U);
  std::swap(frame.fit.models[0], frame.fit.models[1]);
  frame.fit.models[0].parameters[3] = 1.51;
  tracker.follow(frame);
  EXPECT_EQ(frame.fit.models[0].id, 2U);
  EXPECT_EQ(frame.fit.models[1].id, 1U);
  frame.fit.models.pop_back();
  tracker.follow(frame);
  EXPECT_EQ(tracker.planes().size(), 2U) << "out of sight for a moment";
  for (int i = 0; i < 20; ++i) tracker.follow(frame);
  EXPECT_EQ(tracker.planes().size(), 1U);
}

const std::vector<test::Box> kBoxes = {{{-0.25, 0.05, 0.06}, {0.05, 0.05, 0.06}, 0.3},
                                       {{0.05, 0.1, 0.05}, {0.06, 0.04, 0.05}, -0.2},
                                       {{0.3, -0.05, 0.07}, {0.04, 0.05, 0.07}, 0.1}};

TEST(Perceiver, FollowsThingsThatMoveAndRepeatsItself) {
  std::vector<std::vector<std::uint64_t>> runs;
  for (int run = 0; run < 2; ++run) {
    PerceiveOptions options;
    options.track = true;
    options.fit.threads = run + 1;
    auto perceiver = Perceiver::create(options);
    ASSERT_TRUE(perceiver) << perceiver.error().message;
    runs.emplace_back();
    for (int k = 0; k < 6; ++k) {
      auto boxes = kBoxes;
      for (auto& box : boxes) box.centre.x() += 0.015 * k;
      const auto frame = test::render_table(boxes);
      const auto result = perceiver->perceive(frame.cloud);
      ASSERT_TRUE(result) << result.error().message;
      ASSERT_EQ(result->sois.size(), 3U) << k;
      EXPECT_EQ(result->fit.models.at(0).id, 1U);
      for (std::uint16_t b = 0; b < 3; ++b) {
        const auto found = test::agreement(frame.truth, static_cast<std::uint16_t>(2 + b), result->popout);
        ASSERT_GT(found.label, 0);
        runs.back().push_back(result->sois[found.label - 1u].id);
      }
    }
  }
  EXPECT_EQ(runs[0], runs[1]) << "on another number of threads";
  for (std::size_t i = 3; i < runs[0].size(); ++i) EXPECT_EQ(runs[0][i], runs[0][i - 3]);
}

TEST(Perceiver, WithoutTrackingNothingHasAnId) {
  auto perceiver = Perceiver::create({});
  ASSERT_TRUE(perceiver);
  const auto frame = test::render_table(kBoxes);
  const auto result = perceiver->perceive(frame.cloud);
  ASSERT_TRUE(result);
  for (const auto& soi : result->sois) EXPECT_EQ(soi.id, 0U);
  EXPECT_EQ(to_json(*result, frame.cloud).find("\"id\""), std::string::npos);
}

TEST(Scene, AWalkShowsTheSameRoom) {
  const Scene first = make_room_scene(1, 160, 120), still = make_room_scene(1, 160, 120, walk_in_room(0, 300));
  EXPECT_EQ(first.cloud.rgb, still.cloud.rgb);
  const Scene later = make_room_scene(1, 160, 120, walk_in_room(75, 300));
  EXPECT_NE(first.cloud.rgb, later.cloud.rgb);
  ASSERT_EQ(later.truth.object_ids.size(), later.truth.objects);
  // Points on a surface lie on its plane, from there too.
  for (std::size_t i = 0; i < later.cloud.size(); ++i) {
    const auto label = later.truth.plane_labels[i];
    if (label == 0 || !std::isfinite(later.cloud.values32[3 * i])) continue;
    const Eigen::Vector3d p(static_cast<double>(later.cloud.values32[3 * i]), static_cast<double>(later.cloud.values32[3 * i + 1]),
                            static_cast<double>(later.cloud.values32[3 * i + 2]));
    const auto& plane = later.truth.planes[label - 1u];
    ASSERT_LT(std::abs(plane.head<3>().dot(p) + plane[3]), 0.1) << i;
  }
}

/// An organised cloud with one colour.
std::string pcd(const Cloud& cloud) {
  const std::string count = std::to_string(cloud.size());
  std::string out = "VERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH " + std::to_string(cloud.width) +
                    "\nHEIGHT " + std::to_string(cloud.height) + "\nPOINTS " + count + "\nDATA binary\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (std::size_t d = 0; d < 3; ++d) out += raw(cloud.values32[3 * i + d]);
    out += raw(std::uint32_t{0x808080});
  }
  return out;
}

std::vector<json> lines(const std::string& text) {
  std::vector<json> all;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) all.push_back(json::parse(line));
  return all;
}

class CliSequence : public testing::Test {
 protected:
  CliSequence() { fs::create_directory(folder_ / "in"); }
  /// A table with boxes that have moved on by a bit a frame.
  void put(const std::string& name, int k) {
    auto boxes = kBoxes;
    for (auto& box : boxes) box.centre.x() += 0.01 * k;
    folder_.put(name, pcd(test::render_table(boxes, 0.0015, 160, 120).cloud));
  }
  TemporaryFolder folder_;
};

TEST_F(CliSequence, AFolderIsALineAFrameInOrder) {
  for (const int k : {1, 2, 10}) put("in/f" + std::to_string(k) + ".pcd", k);
  const auto outcome = run_swarmfit(folder_, {"perceive", "in", "--out", "out"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("3 frames"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("p99"), std::string::npos);
  const auto all = lines(outcome.out);
  ASSERT_EQ(all.size(), 3U);
  std::set<int> first;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all[i]["schema"], 1);
    EXPECT_EQ(all[i]["frame"]["index"], i);
    EXPECT_GT(all[i]["timing_ms"]["total"], 0.0);
    EXPECT_EQ(all[i]["models"].at(0)["id"], 1);
    ASSERT_EQ(all[i]["sois"].size(), 3U) << i;
    std::set<int> now;
    for (const auto& soi : all[i]["sois"]) now.insert(soi["id"].get<int>());
    if (i == 0) first = now;
    EXPECT_EQ(now, first);
  }
  EXPECT_EQ(all[2]["frame"]["name"], "f10");
  for (const char* name : {"result.json", "planes.png", "popout.png", "objects.png", "overlay.png"})
    EXPECT_TRUE(fs::is_regular_file(folder_ / "out/f10" / name)) << name;
  EXPECT_EQ(json::parse(contents(folder_ / "out/f2/result.json"))["models"], all[1]["models"]);
}

TEST_F(CliSequence, AListWhereNamesRepeat) {
  put("a.pcd", 0);
  const auto outcome = run_swarmfit(folder_, {"perceive", "a.pcd", "a.pcd", "--json", "r.jsonl", "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out + outcome.err, "");
  const auto all = lines(contents(folder_ / "r.jsonl"));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0]["frame"]["name"], "0-a");
  EXPECT_EQ(all[1]["frame"]["name"], "1-a");
}

TEST_F(CliSequence, ABadFrameIsOneLineAndTheOthersGoOn) {
  put("in/1.pcd", 1);
  folder_.put("in/2.pcd", "VERSION 0.7\nnonsense\n");
  put("in/3.pcd", 3);
  const auto outcome = run_swarmfit(folder_, {"perceive", "in", "--quiet"});
  EXPECT_EQ(outcome.code, 3);
  EXPECT_TRUE(outcome.err.starts_with("swarmfit: ")) << outcome.err;
  EXPECT_NE(outcome.err.find("2.pcd"), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  const auto all = lines(outcome.out);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1]["frame"]["index"], 2);
  EXPECT_EQ(all[1]["models"].at(0)["id"], all[0]["models"].at(0)["id"]);
}

TEST_F(CliSequence, DepthImagesWithTheirColours) {
  for (int k = 0; k < 2; ++k) {
    const auto cloud = test::render_table(kBoxes, 0.0015, 160, 120).cloud;
    cv::Mat1w depth(120, 160);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const float z = cloud.values32[3 * i + 2];
      depth(static_cast<int>(i) / 160, static_cast<int>(i) % 160) = std::isfinite(z) ? cv::saturate_cast<std::uint16_t>(1000 * z) : 0;
    }
    cv::imwrite((folder_ / ("in/" + std::to_string(k) + ".depth.png")).string(), depth);
    cv::imwrite((folder_ / ("in/" + std::to_string(k) + ".color.png")).string(), cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(90)));
  }
  const auto outcome = run_swarmfit(folder_, {"perceive", "in", "--intrinsics", "131.25,131.25,79.5,59.5"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto all = lines(outcome.out);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1]["frame"]["name"], "1");
  EXPECT_GE(all[1]["sois"].size(), 1U);
  expect_refusal(folder_, {"perceive", "in"}, 2, "--intrinsics");
}

TEST_F(CliSequence, ACameraThatDoesNotWaitLosesFrames) {
  put("a.pcd", 0);
  std::vector<std::string> arguments = {"perceive", "--fps", "2000"};
  for (int k = 0; k < 200; ++k) arguments.emplace_back("a.pcd");
  const auto outcome = run_swarmfit(folder_, arguments);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto all = lines(outcome.out);
  ASSERT_GE(all.size(), 2U);
  EXPECT_LT(all.size(), 200U);
  EXPECT_NE(outcome.err.find(std::to_string(200 - all.size()) + " dropped"), std::string::npos) << outcome.err;
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GT(all[i]["frame"]["index"], all[i - 1]["frame"]["index"]);
  EXPECT_EQ(all.back()["frame"]["index"], 199);
}

TEST_F(CliSequence, WrongUsage) {
  put("a.pcd", 0);
  fs::create_directory(folder_ / "empty");
  expect_refusal(folder_, {"perceive", "empty"}, 3, "holds no frame");
  expect_refusal(folder_, {"perceive", "a.pcd", "a.pcd", "--labels", "l.txt"}, 2, "--labels");
  expect_refusal(folder_, {"perceive", "a.pcd", "a.pcd", "--fps", "0"}, 2, "--fps");
  expect_refusal(folder_, {"perceive", "a.pcd", "a.pcd", "--drop"}, 2, "--drop");
  expect_refusal(folder_, {"perceive", "a.pcd", "--fps", "3"}, 2, "--fps");
  expect_refusal(folder_, {"perceive", "a.pcd", "none.pcd", "--json", "no/r.jsonl"}, 3, "no/r.jsonl");
  expect_refusal(folder_, {"demo", "--frames", "0"}, 2, "--frames");
}

TEST(CliDemo, AWalkKeepsIdentities) {
  const TemporaryFolder folder;
  const auto outcome = run_swarmfit(folder, {"demo", "--frames", "6"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(lines(outcome.out).size(), 6U);
  EXPECT_NE(outcome.err.find("true objects in"), std::string::npos) << outcome.err;
  EXPECT_EQ(folder.entries(), 0U);
}

}  // namespace
}  // namespace swarmfit
