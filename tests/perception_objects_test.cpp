#include <numbers>

#include <gtest/gtest.h>

#include "host/perception/contacts.hpp"
#include "host/perception/objects.hpp"
#include "host/perception/patches.hpp"
#include "host/perception/runs.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit::perception {
namespace {

struct Scene {
  test::Rendering rendering;
  PointGrid grid;
  Popout popout;
  ObjectLabels objects;
};

Scene perceive(const std::vector<test::Box>& boxes) {
  Scene scene{test::render_table(boxes, 0.0015, 640, 480), {}, {}, {}};
  scene.grid = make_grid(scene.rendering.cloud);
  const std::vector<Surface> surfaces{make_surface(scene.grid, scene.rendering.table_labels(), 1, scene.rendering.table(), 0.02)};
  scene.popout = pop_out(scene.grid, surfaces, {});
  scene.objects = separate(scene.grid, scene.popout, {0.02, surfaces[0].noise, scene.rendering.table().normal});
  return scene;
}

void expect_objects(const Scene& scene, int count) {
  ASSERT_EQ(scene.objects.support.size(), static_cast<std::size_t>(count));
  std::vector<std::uint16_t> labels;
  for (int k = 0; k < count; ++k) {
    const auto match = test::agreement(scene.rendering.truth, static_cast<std::uint16_t>(2 + k), scene.objects.of_point);
    EXPECT_GT(match.recall, 0.9) << "box " << k;
    EXPECT_GT(match.precision, 0.95) << "box " << k;
    EXPECT_EQ(std::count(labels.begin(), labels.end(), match.label), 0) << "box " << k << " shares a label";
    labels.push_back(match.label);
  }
}

TEST(Objects, OneBoxIsOneObject) { expect_objects(perceive({{{0, 0, 0.08}, {0.12, 0.07, 0.08}, 0.4}}), 1); }

TEST(Objects, AStackIsTakenApart) {
  const auto scene = perceive({{{0, 0, 0.05}, {0.14, 0.12, 0.05}, 0.2}, {{0.02, 0.03, 0.15}, {0.07, 0.06, 0.05}, 0.9}});
  EXPECT_EQ(scene.popout.size.size(), 1u);
  expect_objects(scene, 2);
}

TEST(Objects, BoxesThatTouchAreTakenApart) {
  const auto scene = perceive({{{-0.08, 0, 0.1}, {0.08, 0.05, 0.1}, 0.5}, {{0.08, -0.06, 0.06}, {0.08, 0.05, 0.06}, -0.6}});
  expect_objects(scene, 2);
}

TEST(Objects, ABoxIsOneToBothSidesOfWhatStandsBeforeIt) {
  const auto scene = perceive({{{0, 0.1, 0.06}, {0.22, 0.04, 0.06}}, {{0, -0.12, 0.2}, {0.05, 0.03, 0.2}}});
  EXPECT_EQ(scene.popout.size.size(), 3u);
  expect_objects(scene, 2);
}

TEST(Objects, TwoBoxesInLineWithAGapBetweenStayTwo) {
  expect_objects(perceive({{{-0.15, 0, 0.06}, {0.1, 0.04, 0.06}}, {{0.15, 0, 0.06}, {0.1, 0.04, 0.06}}}), 2);
}

TEST(Objects, TopsOfOneHeightToBothSidesOfAThingAreOfTwo) {
  // The line between their middles is hidden, those between their ends are not: they are not one face.
  expect_objects(
      perceive(
          {{{-0.15, 0.15, 0.05}, {0.08, 0.06, 0.05}}, {{0.15, -0.05, 0.05}, {0.08, 0.06, 0.05}}, {{0, -0.05, 0.13}, {0.068, 0.03, 0.13}}}),
      3);
}

/// Staves around a piece of table, from the farthest on to both sides, so many of 24; and behind them a carton that is higher.
std::vector<test::Box> pot_before_carton(int staves) {
  constexpr double kRadius = 0.11;
  std::vector<test::Box> boxes;
  for (int k = 0; k < staves; ++k) {
    const double angle = std::numbers::pi / 12 * (k % 2 == 0 ? k / 2 : -(k + 1) / 2);
    boxes.push_back({{kRadius * std::sin(angle), kRadius * std::cos(angle), 0.05}, {0.016, 0.004, 0.05}, -angle});
  }
  boxes.push_back({{0, 0.2, 0.12}, {0.2, 0.04, 0.12}});
  return boxes;
}

TEST(Objects, AVesselEndsAtItsRim) {
  // One whose near side is there, and one of which the inside alone is seen.
  for (const int staves : {24, 13}) {
    const auto scene = perceive(pot_before_carton(staves));
    const auto label_of = [&](int box) {
      return test::agreement(scene.rendering.truth, static_cast<std::uint16_t>(2 + box), scene.objects.of_point).label;
    };
    EXPECT_EQ(label_of(0), label_of(staves - 1)) << staves;
    EXPECT_NE(label_of(0), label_of(staves)) << staves;
    EXPECT_GT(test::agreement(scene.rendering.truth, static_cast<std::uint16_t>(2 + staves), scene.objects.of_point).precision, 0.95)
        << staves;
  }
}

TEST(Objects, WhatHangsOnAThingIsPartOfIt) {
  const test::Box body{{0, 0, 0.1}, {0.06, 0.05, 0.1}};
  // In the air beside it, as thick as a good handle.
  const auto handle = perceive({body, {{0.09, -0.03, 0.13}, {0.033, 0.033, 0.03}, 0.5}});
  EXPECT_EQ(handle.objects.support.size(), 1u);
  // The same on the table is a thing of its own.
  EXPECT_EQ(perceive({body, {{0.09, -0.03, 0.03}, {0.033, 0.033, 0.03}, 0.5}}).objects.support.size(), 2u);
}

TEST(Objects, ACapIsPartOfItsCarton) {
  const test::Box carton{{0, 0, 0.15}, {0.2, 0.1, 0.15}};
  // It is seen as about a fifteenth of the carton; twice that is a thing that stands on it.
  EXPECT_EQ(perceive({carton, {{0, 0, 0.327}, {0.045, 0.036, 0.027}}}).objects.support.size(), 1u);
  EXPECT_EQ(perceive({carton, {{0, 0, 0.3375}, {0.0625, 0.05, 0.0375}}}).objects.support.size(), 2u);
}

TEST(Objects, TheFloorOfAVesselJoinsIt) {
  // Four walls around a piece of table.
  const auto scene = perceive({{{0, -0.1, 0.05}, {0.15, 0.005, 0.05}},
                               {{0, 0.2, 0.05}, {0.15, 0.005, 0.05}},
                               {{-0.15, 0.05, 0.05}, {0.005, 0.155, 0.05}},
                               {{0.15, 0.05, 0.05}, {0.005, 0.155, 0.05}}});
  ObjectLabels one{std::vector<std::uint16_t>(scene.grid.size(), 0), {0}};
  for (std::size_t i = 0; i < scene.grid.size(); ++i) one.of_point[i] = scene.rendering.truth[i] >= 2;
  std::vector<std::uint16_t> on_support(scene.grid.size(), 0);
  for (std::size_t i = 0; i < on_support.size(); ++i) on_support[i] = scene.rendering.truth[i] == 1;
  const auto before = one.of_point;
  fill_basins(scene.grid, on_support, std::vector<std::uint8_t>{0, 1}, 0, one);
  std::size_t joined = 0, inside = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] != 0 || on_support[i] == 0) continue;
    // The world's axes: x is the camera's, y follows from the height and the depth.
    const auto& p = scene.grid.points[i];
    const Eigen::Vector3d back = scene.rendering.up.cross(Eigen::Vector3d(1, 0, 0));
    const double y = back.dot(p.cast<double>()) - 1;
    const bool within = std::abs(p.x()) < 0.14 && y > -0.09 && y < 0.19;
    inside += within;
    if (within) joined += one.of_point[i] == 1;
    if (std::abs(p.x()) > 0.2 || y < -0.15 || y > 0.45) {
      ASSERT_EQ(one.of_point[i], 0) << "x " << p.x() << " y " << y;
    }
  }
  ASSERT_GT(inside, 1000u);
  EXPECT_GT(static_cast<double>(joined), 0.95 * static_cast<double>(inside));
}

/// Of one box before the camera, with depths that are off by this at one metre [m].
CoarseGrid coarse_box(double noise) {
  const auto rendering = test::render_table({{{0, 0, 0.1}, {0.15, 0.1, 0.1}, 0.4}}, noise, 640, 480);
  const auto grid = make_grid(rendering.cloud);
  Popout popout;
  popout.group.assign(grid.size(), 0);
  for (std::size_t i = 0; i < grid.size(); ++i) popout.group[i] = rendering.truth[i] == 2 ? 1 : 0;
  return make_coarse_grid(grid, popout);
}

TEST(Patches, NormalsAreThoseOfFaces) {
  const auto coarse = coarse_box(0.0003);
  // In the fixture's camera: right, down and forward of a camera that looks 42 degrees down.
  const Eigen::Vector3f up(0, -std::cos(0.733f), -std::sin(0.733f)), right(1, 0, 0), back = up.cross(right);
  const Eigen::Vector3f side = std::cos(0.4f) * right + std::sin(0.4f) * back, front = std::sin(0.4f) * right - std::cos(0.4f) * back;
  std::size_t told = 0, along = 0;
  for (std::size_t at = 0; at < coarse.group.size(); ++at) {
    const Eigen::Vector3f& n = coarse.normals[at];
    if (coarse.group[at] == 0 || n.squaredNorm() == 0) continue;
    ASSERT_NEAR(n.norm(), 1, 1e-3);
    ASSERT_LE(n.dot(coarse.points[at]), 0);  // towards the camera
    ++told;
    along += std::max({std::abs(n.dot(up)), std::abs(n.dot(side)), std::abs(n.dot(front))}) > 0.995f ? 1 : 0;
  }
  ASSERT_GT(told, 2000u);
  EXPECT_GT(static_cast<double>(along), 0.8 * static_cast<double>(told));  // the others lie across an edge
}

TEST(Patches, NoiseMakesNormalsUnsteady) {
  EXPECT_EQ(coarse_box(0.0005).unsteady, 0.0F);
  EXPECT_EQ(coarse_box(0.01).unsteady, 1.0F);
}

TEST(Contacts, WhatMerelyTouchesStaysApartWhereNormalsAreSteady) {
  CoarseGrid coarse;
  Patches patches;
  patches.list.resize(3);
  for (Patch& patch : patches.list) patch.cells = 400;
  // The first two touch in three cells; the last two share an edge.
  const Contacts contacts{{{0, 1}, {3, 3}}, {{1, 2}, {20, 20}}};
  EXPECT_EQ(contract(coarse, patches, contacts), (std::vector<int>{0, 1, 1}));
  coarse.unsteady = 1;
  EXPECT_EQ(contract(coarse, patches, contacts), (std::vector<int>{0, 0, 0}));
}

TEST(Objects, SpacesAreOrderedAndHoldTheirPoints) {
  auto scene = perceive({{{-0.3, 0, 0.03}, {0.03, 0.03, 0.03}}, {{0.25, 0.1, 0.1}, {0.1, 0.05, 0.1}, 0.6}});
  const std::vector<int> models{3};
  auto labels = scene.objects;
  const auto spaces = make_spaces(scene.grid, models, 100, 1.2, 0, labels);
  ASSERT_EQ(spaces.size(), 2u);
  EXPECT_GT(spaces[0].points, spaces[1].points);
  const auto large = test::agreement(scene.rendering.truth, 3, labels.of_point);
  EXPECT_EQ(large.label, 1);
  for (std::size_t i = 0; i < labels.of_point.size(); ++i) {
    if (labels.of_point[i] == 0) continue;
    const auto& soi = spaces[labels.of_point[i] - 1u];
    ASSERT_LE((scene.grid.points[i].cast<double>() - soi.centre).norm(), soi.radius);
    const int u = static_cast<int>(i % 640), v = static_cast<int>(i / 640);
    ASSERT_TRUE(u >= soi.bbox[0] && u < soi.bbox[0] + soi.bbox[2] && v >= soi.bbox[1] && v < soi.bbox[1] + soi.bbox[3]);
    EXPECT_EQ(soi.plane, 3);
  }
  EXPECT_LT(spaces[0].radius, 1.2 * 1.25 * std::sqrt(0.01 + 0.0025 + 0.01));
  EXPECT_TRUE(make_spaces(scene.grid, models, 1000000, 1.2, 0, labels).empty());
  EXPECT_EQ(std::count(labels.of_point.begin(), labels.of_point.end(), 0), static_cast<std::ptrdiff_t>(labels.of_point.size()));
}

TEST(Runs, AreTheStretchesOfEachLabelWhereverTheyBegin) {
  const std::vector<std::uint16_t> labels{1, 0, 0, 2, 2, 3, 0, 0, 0, 0, 0, 0, 0, 4, 4, 4, 0, 0, 5};
  for (std::size_t begin = 0; begin <= labels.size(); ++begin)
    for (std::size_t end = begin; end <= labels.size(); ++end) {
      std::vector<std::uint16_t> seen(labels.size(), 0), expected(labels.size(), 0);
      std::copy(labels.begin() + static_cast<std::ptrdiff_t>(begin), labels.begin() + static_cast<std::ptrdiff_t>(end),
                expected.begin() + static_cast<std::ptrdiff_t>(begin));
      std::size_t last_end = begin;
      for_each_run(labels, begin, end, [&](std::size_t first, std::size_t last, std::uint16_t label) {
        EXPECT_TRUE(last_end <= first && first < last && last <= end) << begin << " " << end;
        last_end = last;
        for (std::size_t i = first; i < last; ++i) seen[i] = label;
      });
      EXPECT_EQ(seen, expected) << begin << " " << end;
    }
}

}  // namespace
}  // namespace swarmfit::perception
