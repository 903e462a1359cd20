#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include <swarmfit/perception.hpp>
#include <swarmfit/scene.hpp>

#include "tests/perception_fixture.hpp"

namespace swarmfit {
namespace {

const std::vector<test::Box> kBoxes{
    {{-0.3, 0, 0.08}, {0.08, 0.06, 0.08}}, {{0.2, 0.05, 0.05}, {0.12, 0.1, 0.05}, 0.3}, {{0.2, 0.05, 0.14}, {0.05, 0.05, 0.04}, 0.9}};

PerceiveOptions on_cpu() {
  PerceiveOptions options;
  options.fit.backend = "cpu";
  options.fit.threads = 1;
  return options;
}

Expected<PerceiveResult> perceive(const Cloud& cloud, const PerceiveOptions& options = on_cpu()) {
  auto perceiver = Perceiver::create(options);
  if (!perceiver) return tl::unexpected(perceiver.error());
  return perceiver->perceive(cloud);
}

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(std::abs(a.normalized().dot(b.normalized())), 0.0, 1.0)) * 57.29577951308232;
}

/// A floor 1.6 m below a camera that looks down on it, its heights in two steps, as structured light gives them far off.
Cloud stepped_floor(double step) {
  Cloud cloud;
  cloud.width = 320;
  cloud.height = 240;
  const Eigen::Vector3d up(0, -std::cos(0.7), -std::sin(0.7));
  for (int v = 0; v < cloud.height; ++v)
    for (int u = 0; u < cloud.width; ++u) {
      const Eigen::Vector3d ray((u - 159.5) / 262.5, (v - 119.5) / 262.5, 1);
      const double below = -up.dot(ray);
      const Eigen::Vector3d p = ray * (1.6 / below), there = ray * ((1.6 - (std::sin(7 * p.x()) > -0.5 ? step : 0)) / below);
      for (int k = 0; k < 3; ++k) cloud.values32.push_back(below > 0.2 ? static_cast<float>(there[k]) : NAN);
    }
  return cloud;
}

std::ptrdiff_t supports(const PerceiveResult& result) {
  return std::count_if(result.fit.models.begin(), result.fit.models.end(), [](const Model& m) { return m.supporting; });
}

TEST(Perceiver, AStepIsASurfaceOfItsOwnAndNoiseIsNot) {
  const auto noise = perceive(stepped_floor(0.014));
  ASSERT_TRUE(noise) << noise.error().message;
  EXPECT_EQ(supports(*noise), 1);
  const auto step = perceive(stepped_floor(0.06));
  ASSERT_TRUE(step) << step.error().message;
  EXPECT_EQ(supports(*step), 2);
}

TEST(Perceiver, AWavyFloorIsOneSurface) {
  const char* data = std::getenv("SWARMFIT_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set";
  const auto folder = std::filesystem::path(data) / "rgbd";
  const auto frame = read_rgbd(folder / "5.color.png", folder / "5.depth.png", {612.937, 613.173, 322.549, 248.158}, 0.001);
  if (!frame) GTEST_SKIP() << frame.error().message;
  const auto result = perceive(*frame);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(supports(*result), 2) << "a table and the floor";
}

TEST(Perceiver, ATableWithThreeBoxes) {
  const auto scene = test::render_table(kBoxes, 0.0015, 640, 480);
  const auto result = perceive(scene.cloud);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->vertical_source, "dominant plane");
  EXPECT_LT(degrees_between(result->up, scene.up), 0.5);
  ASSERT_EQ(std::count_if(result->fit.models.begin(), result->fit.models.end(), [](const Model& m) { return m.supporting; }), 1);
  const Model& table = result->fit.models[0];
  ASSERT_TRUE(table.supporting);
  EXPECT_GT(table.normal().dot(scene.up), 0.9999);
  EXPECT_NEAR(table.offset(), scene.height, 0.003);
  EXPECT_EQ(table.inliers, static_cast<std::size_t>(std::count(result->fit.labels.begin(), result->fit.labels.end(), 1)));
  const auto on_table = test::agreement(scene.truth, 1, result->fit.labels);
  EXPECT_EQ(on_table.label, 1);
  EXPECT_GT(on_table.recall, 0.98);
  EXPECT_GT(on_table.precision, 0.98);
  ASSERT_EQ(result->sois.size(), 3u);
  for (std::uint16_t k = 0; k < 3; ++k) {
    const auto object = test::agreement(scene.truth, static_cast<std::uint16_t>(2 + k), result->popout);
    EXPECT_GT(object.recall, 0.85) << k;
    EXPECT_GT(object.precision, 0.95) << k;
    EXPECT_EQ(result->sois[object.label - 1u].plane, 1);
  }
  // Without colour the outlines are those of the points.
  EXPECT_EQ(result->objects, result->popout);
  EXPECT_GE(result->timing_ms.total, result->timing_ms.fit);
}

TEST(Perceiver, TheBuiltInRoom) {
  const auto scene = make_room_scene();
  const auto result = perceive(scene.cloud);
  ASSERT_TRUE(result) << result.error().message;
  for (const auto& truth : scene.truth.planes) {
    const bool found = std::any_of(result->fit.models.begin(), result->fit.models.end(), [&](const Model& model) {
      if (!model.supporting || degrees_between(model.normal(), truth.head<3>()) > 2) return false;
      const double sign = model.normal().dot(truth.head<3>()) > 0 ? 1 : -1;
      return std::abs(sign * model.offset() - truth[3]) < 0.02;
    });
    EXPECT_TRUE(found) << truth.transpose();
  }
  EXPECT_GE(result->sois.size(), scene.truth.objects / 2);
  EXPECT_EQ(result->objects.size(), scene.cloud.size());
}

TEST(Perceiver, TheVerticalOfTheFirstViewIsKept) {
  auto perceiver = Perceiver::create(on_cpu());
  ASSERT_TRUE(perceiver) << perceiver.error().message;
  const auto scene = test::render_table(kBoxes);
  const auto first = perceiver->perceive(scene.cloud);
  ASSERT_TRUE(first) << first.error().message;
  const auto second = perceiver->perceive(test::render_table({}).cloud);
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(first->up, second->up);
  EXPECT_TRUE(second->sois.empty());
}

TEST(Perceiver, GravityAndTilt) {
  const auto scene = test::render_table(kBoxes);
  auto options = on_cpu();
  options.gravity = -2 * scene.up;
  const auto by_gravity = perceive(scene.cloud, options);
  ASSERT_TRUE(by_gravity) << by_gravity.error().message;
  EXPECT_EQ(by_gravity->vertical_source, "gravity");
  EXPECT_TRUE(by_gravity->up.isApprox(scene.up));
  EXPECT_FALSE(by_gravity->sois.empty());
  options.gravity.reset();
  options.camera_tilt = 0.733;
  const auto by_tilt = perceive(scene.cloud, options);
  ASSERT_TRUE(by_tilt) << by_tilt.error().message;
  EXPECT_EQ(by_tilt->vertical_source, "camera tilt");
  EXPECT_TRUE(by_tilt->up.isApprox(scene.up, 1e-9));
  // No plane is horizontal when gravity points along the table.
  options.camera_tilt.reset();
  options.gravity = Eigen::Vector3d(1, 0, 0);
  const auto sideways = perceive(test::render_table({}).cloud, options);
  ASSERT_TRUE(sideways) << sideways.error().message;
  EXPECT_TRUE(sideways->fit.models.empty());
  EXPECT_EQ(std::count(sideways->fit.labels.begin(), sideways->fit.labels.end(), 0),
            static_cast<std::ptrdiff_t>(sideways->fit.labels.size()));
}

TEST(Perceiver, ThreadsDoNotChangeTheAnswer) {
  const auto scene = make_room_scene(3, 320, 240);
  auto options = on_cpu();
  const auto one = perceive(scene.cloud, options);
  options.fit.threads = 2;
  const auto two = perceive(scene.cloud, options);
  ASSERT_TRUE(one && two);
  ASSERT_EQ(one->fit.models.size(), two->fit.models.size());
  for (std::size_t k = 0; k < one->fit.models.size(); ++k) EXPECT_EQ(one->fit.models[k].parameters, two->fit.models[k].parameters);
  EXPECT_EQ(one->fit.labels, two->fit.labels);
  EXPECT_EQ(one->popout, two->popout);
  EXPECT_EQ(one->objects, two->objects);
}

TEST(Perceiver, WithoutAGridTheStagesThatNeedOneAreLeftOut) {
  auto cloud = test::render_table(kBoxes).cloud;
  cloud.width *= cloud.height;
  cloud.height = 1;
  const auto result = perceive(cloud);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->objects.empty());
  ASSERT_GE(result->sois.size(), 2u);
  EXPECT_EQ(result->sois[0].bbox, (std::array<int, 4>{}));
  EXPECT_GT(result->sois[0].radius, 0.05);
}

TEST(Perceiver, WhatCannotBeUsedIsAnswered) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Cloud all_nan;
  all_nan.width = 64;
  all_nan.height = 48;
  all_nan.values32.assign(3 * 64 * 48, nan);
  auto result = perceive(all_nan);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, Error::Kind::bad_input);
  EXPECT_NE(result.error().message.find("finite points is 0 of 3072"), std::string::npos) << result.error().message;

  Cloud two;
  two.values32 = {0, 0, 1, 0, 1, 1};
  two.width = 2;
  two.height = 1;
  result = perceive(two);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, Error::Kind::bad_input);

  Cloud empty;
  EXPECT_FALSE(perceive(empty));

  Cloud flat;
  flat.dimension = 2;
  flat.values32 = {0, 0, 1, 0, 1, 1};
  flat.width = 3;
  flat.height = 1;
  result = perceive(flat);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("2 columns"), std::string::npos) << result.error().message;
}

TEST(Perceiver, AFrameWhoseListsDoNotAgreeIsRefused) {
  auto perceiver = Perceiver::create({});
  ASSERT_TRUE(perceiver);
  const Cloud whole = test::render_table({}, 0.001, 32, 24).cloud;
  ASSERT_TRUE(whole.validate());
  const auto refused = [&](auto change) {
    Cloud frame = whole;
    change(frame);
    const auto result = perceiver->perceive(frame);
    return result                                          ? std::string("taken")
           : result.error().kind == Error::Kind::bad_input ? result.error().message
                                                           : std::string("otherwise");
  };
  EXPECT_EQ(refused([](Cloud& c) { c.width = 640; }), "cloud.width is 640, must be its 768 points over its height, 24");
  EXPECT_EQ(refused([](Cloud& c) { c.values32.resize(300); }), "cloud.width is 32, must be its 100 points over its height, 24");
  EXPECT_EQ(refused([](Cloud& c) { c.values32.pop_back(); }), "cloud.values is 2303, must be a multiple of its dimension, 3");
  EXPECT_EQ(refused([](Cloud& c) { c.rgb.resize(768); }), "cloud.rgb.size() is 768, must be 0 or 2304, 3 a point");
  EXPECT_EQ(refused([](Cloud& c) { c.values64.resize(3); }), "cloud.values64.size() is 3, must be 0 where values32 is filled");
  EXPECT_EQ(refused([](Cloud& c) { c.dimension = 0; }), "cloud.dimension is 0, must be 2, 3 or 4");
}

TEST(Perceiver, TinyFramesDoNotCrash) {
  for (const int size : {2, 3, 5, 9, 17, 33}) {
    const auto scene = test::render_table(kBoxes, 0.0015, size, size);
    const auto result = perceive(scene.cloud);
    if (!result) {
      EXPECT_EQ(result.error().kind, Error::Kind::bad_input) << size;
      continue;
    }
    EXPECT_EQ(result->fit.labels.size(), scene.cloud.size()) << size;
    EXPECT_EQ(result->popout.size(), scene.cloud.size()) << size;
  }
}

TEST(Perceiver, TheCallbackMayStop) {
  const auto scene = make_room_scene(1, 320, 240);
  auto perceiver = Perceiver::create(on_cpu());
  ASSERT_TRUE(perceiver) << perceiver.error().message;
  int told = 0;
  const auto result = perceiver->perceive(scene.cloud, [&](const Model& model) {
    ++told;
    EXPECT_EQ(model.type, ModelType::plane);
    EXPECT_GT(model.inliers, 0u);
    return Verdict::stop;
  });
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(told, 1);
  EXPECT_LE(result->fit.models.size(), 1u);
}

TEST(Perceiver, OptionsAreChecked) {
  auto options = on_cpu();
  options.soi_margin = 0;
  const auto perceiver = Perceiver::create(options);
  ASSERT_FALSE(perceiver);
  EXPECT_EQ(perceiver.error().kind, Error::Kind::invalid_option);
  options = on_cpu();
  options.fit.backend = "no such thing";
  EXPECT_EQ(Perceiver::create(options).error().kind, Error::Kind::backend_unavailable);
  options = on_cpu();
  options.gallery = "/nowhere/at/all";
  EXPECT_EQ(Perceiver::create(options).error().kind, Error::Kind::bad_input);
}

}  // namespace
}  // namespace swarmfit
