#include <gtest/gtest.h>

#include "host/perception/popout.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit::perception {
namespace {

const std::vector<test::Box> kTwoApart{{{-0.3, 0, 0.08}, {0.08, 0.06, 0.08}}, {{0.25, 0.1, 0.05}, {0.1, 0.05, 0.05}, 0.6}};

struct Scene {
  test::Rendering rendering;
  PointGrid grid;
  std::vector<Surface> surfaces;
};

Scene make_scene(const std::vector<test::Box>& boxes, bool organised = true) {
  Scene scene{test::render_table(boxes), {}, {}};
  if (!organised) {
    scene.rendering.cloud.width *= scene.rendering.cloud.height;
    scene.rendering.cloud.height = 1;
  }
  scene.grid = make_grid(scene.rendering.cloud);
  scene.surfaces.push_back(make_surface(scene.grid, scene.rendering.table_labels(), 1, scene.rendering.table(), 0.02));
  return scene;
}

TEST(Popout, FindsEachBoxAndNothingOfTheTable) {
  for (const bool organised : {true, false}) {
    const auto scene = make_scene(kTwoApart, organised);
    const auto popout = pop_out(scene.grid, scene.surfaces, {});
    ASSERT_EQ(popout.size.size(), 2u) << organised;
    const auto a = test::agreement(scene.rendering.truth, 2, popout.group), b = test::agreement(scene.rendering.truth, 3, popout.group);
    EXPECT_NE(a.label, b.label);
    EXPECT_GT(a.recall, 0.93) << organised;
    EXPECT_GT(b.recall, 0.88) << organised;
    EXPECT_GT(a.precision, 0.99) << organised;
    EXPECT_GT(b.precision, 0.99) << organised;
    EXPECT_EQ(popout.support, (std::vector<int>{0, 0}));
  }
}

TEST(Popout, DebrisIsDropped) {
  auto boxes = kTwoApart;
  boxes.push_back({{0, -0.2, 0.015}, {0.015, 0.015, 0.015}});
  const auto scene = make_scene(boxes);
  EXPECT_EQ(pop_out(scene.grid, scene.surfaces, {.min_points = 300}).size.size(), 2u);
  EXPECT_EQ(pop_out(scene.grid, scene.surfaces, {.min_points = 40}).size.size(), 3u);
}

TEST(Popout, AWallThatGoesOnAboveIsNoObject) {
  auto boxes = kTwoApart;
  boxes.push_back({{0, 0.3, 1}, {0.5, 0.01, 1}});
  const auto scene = make_scene(boxes);
  const auto popout = pop_out(scene.grid, scene.surfaces, {.max_height = 0.4});
  EXPECT_EQ(popout.size.size(), 2u);
  for (std::size_t i = 0; i < popout.group.size(); ++i)
    if (scene.rendering.truth[i] == 4) {
      ASSERT_EQ(popout.group[i], 0);
    }
}

TEST(Popout, ALowWallAlongTheEdgeIsNoObject) {
  auto boxes = kTwoApart;
  boxes.push_back({{0, 0.61, 0.1}, {0.8, 0.01, 0.1}});
  const auto scene = make_scene(boxes);
  const auto popout = pop_out(scene.grid, scene.surfaces, {});
  EXPECT_EQ(popout.size.size(), 2u);
}

TEST(Popout, WhatStandsOnTheUpperLayerIsNotTheLowerOnes) {
  auto scene = make_scene({{{0, 0.1, 0.15}, {0.3, 0.3, 0.15}}, {{0, 0.1, 0.35}, {0.05, 0.05, 0.05}}});
  const auto table = scene.rendering.table();
  std::vector<std::uint16_t> top(scene.grid.size(), 0);
  for (std::size_t i = 0; i < top.size(); ++i)
    top[i] = scene.rendering.truth[i] == 2 && std::abs(table.height(scene.grid.points[i]) - 0.3f) < 0.01f ? 2 : 0;
  scene.surfaces.push_back(make_surface(scene.grid, top, 2, {table.normal, table.offset - 0.3f}, 0.02));
  const auto popout = pop_out(scene.grid, scene.surfaces, {});
  const auto upper = test::agreement(scene.rendering.truth, 3, popout.group);
  EXPECT_GT(upper.recall, 0.85);
  EXPECT_GT(upper.precision, 0.95);
  EXPECT_EQ(popout.support[upper.label - 1u], 1);
}

TEST(Popout, NothingIsAboveNoSurface) {
  const auto scene = make_scene(kTwoApart);
  const auto popout = pop_out(scene.grid, {}, {});
  EXPECT_TRUE(popout.size.empty());
  EXPECT_EQ(std::count(popout.group.begin(), popout.group.end(), 0), static_cast<std::ptrdiff_t>(popout.group.size()));
}

TEST(Popout, TheStepFollowsRangeAndNoise) {
  PointGrid grid;
  grid.pitch = 0.0017f;
  EXPECT_FLOAT_EQ(flood_step_at(grid, 0.001, 0.02, 1), 0.02f);
  EXPECT_GT(flood_step_at(grid, 0.003, 0.02, 3), 0.1f);
  EXPECT_GT(flood_step_at(grid, 0, 0.02, 8), 0.03f);
}

}  // namespace
}  // namespace swarmfit::perception
