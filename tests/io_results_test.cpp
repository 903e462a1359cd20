#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <swarmfit/results.hpp>

#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using nlohmann::json;
using tests::TemporaryFolder;

constexpr int kWidth = 64, kHeight = 48;

Cloud frame() {
  Cloud cloud;
  cloud.width = kWidth;
  cloud.height = kHeight;
  for (int i = 0; i < kWidth * kHeight; ++i)
    cloud.values32.insert(cloud.values32.end(), {0.1F * static_cast<float>(i % kWidth), 0.5F, 1.0F});
  cloud.rgb.assign(cloud.values32.size(), 100);
  return cloud;
}

PerceiveResult result() {
  PerceiveResult r;
  Model plane;
  plane.parameters = Eigen::Vector4d(0, 0.1, 1.0 / 3, -0.7);
  plane.covariance = Eigen::MatrixXd::Identity(4, 4) * 1e-7;
  plane.inliers = 1000;
  plane.rms = std::numeric_limits<double>::quiet_NaN();
  plane.supporting = true;
  plane.found_at_ms = 2.5;
  r.fit.models = {plane};
  r.fit.labels.assign(kWidth * kHeight, 1);
  r.fit.labels[7] = 0;
  r.fit.backend = {"cpu", "a \"quoted\" device", "asked for\n"};
  r.fit.seed = 18446744073709551615U;
  r.fit.threshold = 0.01;
  r.fit.stop_reason = "stable";
  r.fit.finite_points = kWidth * kHeight;
  SpaceOfInterest soi;
  soi.centre = {0.25, -1, 2};
  soi.radius = 0.125;
  soi.points = 42;
  soi.plane = 1;
  soi.bbox = {10, 12, 20, 16};
  soi.recognised = {{"milk \xff", 41, 0.75}};
  r.sois = {soi};
  r.popout.assign(kWidth * kHeight, 0);
  r.objects.assign(kWidth * kHeight, 0);
  for (int y = 14; y < 26; ++y) {
    for (int x = 12; x < 28; ++x)
      r.popout[static_cast<std::size_t>(y * kWidth + x)] = r.objects[static_cast<std::size_t>(y * kWidth + x)] = 1;
  }
  r.objects[0] = kUncertain;
  r.timing_ms = {9, 1, 2, 3, 4, 5};
  return r;
}

TEST(ResultJson, HoldsEveryKeyOfTheSchema) {
  const std::string text = to_json(result(), frame());
  EXPECT_EQ(text.find("nan"), std::string::npos);
  const json j = json::parse(text);
  EXPECT_EQ(j["schema"], 1);
  EXPECT_EQ(j["input"], json::parse(R"({"points":3072,"finite":3072,"width":64,"height":48})"));
  EXPECT_EQ(j["backend"]["device"], "a \"quoted\" device");
  EXPECT_EQ(j["seed"], 18446744073709551615U);
  EXPECT_EQ(j["threshold"], 0.01);
  EXPECT_EQ(j["stop_reason"], "stable");
  const json& m = j["models"][0];
  EXPECT_EQ(m["type"], "plane");
  EXPECT_EQ(m["parameters"]["normal"][2], 1.0 / 3);  // to the last bit
  EXPECT_EQ(m["parameters"]["offset"], -0.7);
  EXPECT_EQ(m["covariance"][3][3], 1e-7);
  EXPECT_EQ(m["covariance"].size(), 4U);
  EXPECT_TRUE(m["rms"].is_null());
  for (const char* key : {"inliers", "cost", "supporting", "iterations", "evaluations", "points_touched", "found_at_ms"})
    EXPECT_TRUE(m.contains(key)) << key;
  EXPECT_EQ(j["sois"][0]["bbox"], json::parse("[10,12,20,16]"));
  EXPECT_EQ(j["sois"][0]["recognised"][0]["inliers"], 41);
  EXPECT_EQ(j["timing_ms"], json::parse(R"({"total":9,"load":1,"fit":2,"popout":3,"segment":4,"recognise":5})"));
}

TEST(ResultJson, OfAFitAlone) {
  FitResult r;
  Model line;
  line.type = ModelType::line2d;
  line.parameters = Eigen::Vector3d(0.6, 0.8, 2);
  r.models = {line};
  r.total_ms = 7;
  Cloud cloud;
  cloud.dimension = 2;
  cloud.values64 = {1, 2, 3, 4};
  cloud.width = 2;
  cloud.height = 1;
  const json j = json::parse(to_json(r, cloud, 3));
  EXPECT_EQ(j["models"][0]["parameters"], json::parse(R"({"normal":[0.6,0.8],"offset":2})"));
  EXPECT_EQ(j["timing_ms"], json::parse(R"({"total":7,"load":3,"fit":7})"));
  EXPECT_EQ(j["sois"].size(), 0U);
}

TEST(ResultJson, EqualResultsAreEqualBytes) {
  EXPECT_EQ(to_json(result(), frame()), to_json(result(), frame()));
  PerceiveResult other = result();
  other.fit.models[0].parameters[0] = std::nextafter(0.0, 1.0);
  EXPECT_NE(to_json(other, frame()), to_json(result(), frame()));
}

TEST(ResultFiles, ImagesHoldTheLabels) {
  const TemporaryFolder folder;
  const auto out = folder / "new/deeper";
  const PerceiveResult r = result();
  const auto written = write_perception(out, r, frame());
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(tests::contents(out / "result.json"), to_json(r, frame()));
  const auto check = [&](const char* name, const std::vector<std::uint16_t>& labels) {
    const cv::Mat image = cv::imread((out / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(image.type(), CV_16UC1) << name;
    ASSERT_EQ(image.size(), cv::Size(kWidth, kHeight)) << name;
    for (std::size_t i = 0; i < labels.size(); ++i)
      ASSERT_EQ(image.at<std::uint16_t>(static_cast<int>(i) / kWidth, static_cast<int>(i) % kWidth), labels[i]) << name;
  };
  check("planes.png", r.fit.labels);
  check("popout.png", r.popout);
  check("objects.png", r.objects);
  const cv::Mat overlay = cv::imread((out / "overlay.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(overlay.type(), CV_8UC3);
  EXPECT_EQ(overlay.size(), cv::Size(kWidth, kHeight));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out), std::filesystem::directory_iterator()), 5);  // and nothing else
  EXPECT_TRUE(write_perception(out, r, frame()));                                                                // over what is there
}

TEST(ResultFiles, OverlayShowsPlanesAndWhatSticksOut) {
  const auto image = render_overlay(result(), frame());
  ASSERT_EQ(image.size(), static_cast<std::size_t>(3 * kWidth * kHeight));
  const auto pixel = [&](int x, int y) { return &image[static_cast<std::size_t>(3 * (y * kWidth + x))]; };
  EXPECT_NE(pixel(2, 40)[0], pixel(2, 40)[1]);                                             // a plane's colour, not the grey below it
  EXPECT_EQ(pixel(7, 0)[0], 100);                                                          // no plane: the image itself
  EXPECT_TRUE(pixel(20, 20)[0] > 130 && pixel(20, 20)[1] > 130 && pixel(20, 20)[2] < 90);  // yellow
}

TEST(ResultFiles, ACloudWithoutAGridIsLabelled) {
  const TemporaryFolder folder;
  Cloud cloud = frame();
  cloud.width = kWidth * kHeight;
  cloud.height = 1;
  ASSERT_TRUE(write_perception(folder / "out", result(), cloud));
  const auto back = read_cloud(folder / "out/labelled.ply");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->values32, cloud.values32);
  EXPECT_TRUE(back->coloured());
  EXPECT_NE(back->rgb[0], back->rgb[3 * 7]);  // plane and none
  EXPECT_FALSE(std::filesystem::exists(folder / "out/planes.png"));

  cloud.values64.assign(cloud.values32.begin(), cloud.values32.end());
  cloud.values64[0] = 5400000.0625;
  cloud.values32.clear();
  ASSERT_TRUE(write_perception(folder / "out", result(), cloud));
  EXPECT_EQ(read_cloud(folder / "out/labelled.ply")->values64[0], 5400000.0625);
}

TEST(ResultFiles, Labels) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_labels(folder / "l.txt", {0, 1, 12, 65535}));
  EXPECT_EQ(tests::contents(folder / "l.txt"), "0\n1\n12\n65535\n");
}

TEST(ResultFiles, NothingIsLeftBehindWhereWritingFails) {
  const TemporaryFolder folder;
  const auto blocker = folder.put("file", "a file where a folder should be");
  const auto expect_refusal = [](const Expected<>& done, const std::string& what) {
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().kind, Error::Kind::cannot_write);
    EXPECT_NE(done.error().message.find(what), std::string::npos) << done.error().message;
  };
  expect_refusal(write_text(blocker / "x.json", "{}"), "x.json");
  expect_refusal(write_text(folder.path(), "{}"), folder.path().string());
  expect_refusal(write_labels(folder / "none/l.txt", {1}), "l.txt");
  expect_refusal(write_perception(blocker / "out", result(), frame()), "out");
  expect_refusal(check_writable(blocker / "x.json"), "x.json");
  expect_refusal(check_writable_folder(blocker / "deeper/out"), "out");
  EXPECT_TRUE(check_writable(folder / "new.json"));
  EXPECT_TRUE(check_writable_folder(folder / "a/b/c"));
  EXPECT_EQ(folder.entries(), 1U);

  // A folder that holds a folder where a file belongs: none of the files appears.
  std::filesystem::create_directories(folder / "out/overlay.png");
  expect_refusal(write_perception(folder / "out", result(), frame()), "overlay.png");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "out"), std::filesystem::directory_iterator()), 1);
}

TEST(ResultFiles, WhatIsThereIsReplacedWholeAndALinkStaysALink) {
  const TemporaryFolder folder;
  const auto real = folder.put("real.json", "old");
  std::filesystem::create_symlink(real, folder / "link.json");
  ASSERT_TRUE(write_text(folder / "link.json", "new"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.json"));
  EXPECT_EQ(tests::contents(real), "new");
  EXPECT_TRUE(write_text("/dev/null", "gone"));
  EXPECT_FALSE(std::filesystem::is_regular_file("/dev/null"));
  EXPECT_EQ(folder.entries(), 2U);
}

}  // namespace
}  // namespace swarmfit
