#include <gtest/gtest.h>

#include "host/perception/surface.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit::perception {
namespace {

TEST(Surface, MeasuresATablesExtentAndNoise) {
  const auto scene = test::render_table({}, 0.002);
  const auto grid = make_grid(scene.cloud);
  const auto surface = make_surface(grid, scene.table_labels(), 1, scene.table(), 0.02);
  EXPECT_NEAR(measure_noise(grid, scene.table_labels(), surface), 0.002 * 0.6, 0.0006);  // along the normal, not along the ray
  EXPECT_NEAR(surface.area, 1.85, 0.15);                                                 // the camera sees most of 1.92 square metres
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (scene.truth[i] == 1) {
      ASSERT_TRUE(surface.contains(grid.points[i])) << i;
    }
  EXPECT_FALSE(surface.contains(Eigen::Vector3f(0, 0, 10)));
}

TEST(Surface, TheShadowOfABoxIsPartOfTheExtent) {
  const auto scene = test::render_table({{{0, 0, 0.1}, {0.1, 0.1, 0.1}}});
  const auto grid = make_grid(scene.cloud);
  const auto surface = make_surface(grid, scene.table_labels(), 1, scene.table(), 0.02);
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (scene.truth[i] == 2) {
      ASSERT_TRUE(surface.contains(grid.points[i])) << i;
    }
}

TEST(Surface, ABoxTopIsToldFromTheTable) {
  const auto scene = test::render_table({{{0, 0, 0.1}, {0.1, 0.1, 0.1}}});
  const auto grid = make_grid(scene.cloud);
  std::vector<std::uint16_t> top(scene.truth.size(), 0);
  const auto table = scene.table();
  for (std::size_t i = 0; i < top.size(); ++i)
    top[i] = scene.truth[i] == 2 && std::abs(table.height(grid.points[i]) - 0.2f) < 0.008f ? 2 : 0;
  const std::vector<Surface> surfaces{make_surface(grid, top, 2, {table.normal, table.offset - 0.2f}, 0.02),
                                      make_surface(grid, scene.table_labels(), 1, table, 0.02)};
  ASSERT_GT(surfaces[0].area, 0.02);
  EXPECT_EQ(choose_supporting(grid, surfaces, 0.6), (std::vector<bool>{false, true}));
  // Farther below than things are high there is no telling; then it is a small table.
  EXPECT_EQ(choose_supporting(grid, surfaces, 0.15), (std::vector<bool>{true, true}));
}

TEST(Surface, ATableAboveAFloorSupports) {
  const auto scene = test::render_table({{{0, 0.1, 0.2}, {0.3, 0.3, 0.2}}});
  const auto grid = make_grid(scene.cloud);
  std::vector<std::uint16_t> top(scene.truth.size(), 0);
  const auto floor = scene.table();
  for (std::size_t i = 0; i < top.size(); ++i)
    top[i] = scene.truth[i] == 2 && std::abs(floor.height(grid.points[i]) - 0.4f) < 0.01f ? 2 : 0;
  const std::vector<Surface> surfaces{make_surface(grid, scene.table_labels(), 1, floor, 0.02),
                                      make_surface(grid, top, 2, {floor.normal, floor.offset - 0.4f}, 0.02)};
  EXPECT_EQ(choose_supporting(grid, surfaces, 0.6), (std::vector<bool>{true, true}));
}

/// What of the boxes is seen at this height above the table: a surface, after the table.
std::vector<Surface> table_and_tops(const test::Rendering& scene, const PointGrid& grid, float height) {
  const auto table = scene.table();
  std::vector<std::uint16_t> tops(scene.truth.size(), 0);
  for (std::size_t i = 0; i < tops.size(); ++i)
    tops[i] = scene.truth[i] >= 2 && std::abs(table.height(grid.points[i]) - height) < 0.008f ? 2 : 0;
  return {make_surface(grid, scene.table_labels(), 1, table, 0.02),
          make_surface(grid, tops, 2, {table.normal, table.offset - height}, 0.02)};
}

TEST(Surface, TopsOfThingsInARowDoNotSupport) {
  std::vector<test::Box> row;
  for (const double x : {-0.2, 0.0, 0.2}) row.push_back({{x, 0, 0.05}, {0.099, 0.08, 0.05}});
  const auto scene = test::render_table(row);
  const auto grid = make_grid(scene.cloud);
  const auto surfaces = table_and_tops(scene, grid, 0.1f);
  ASSERT_GT(surfaces[1].piece_length, 0.5);  // than any one thing's top
  EXPECT_EQ(choose_supporting(grid, surfaces, 0.6), (std::vector<bool>{true, false}));
}

TEST(Surface, ABoardOfThatSizeSupports) {
  const auto scene = test::render_table({{{0, 0, 0.09}, {0.3, 0.08, 0.01}}});
  const auto grid = make_grid(scene.cloud);
  const auto surfaces = table_and_tops(scene, grid, 0.1f);
  ASSERT_GT(surfaces[1].piece_length, 0.5);
  EXPECT_EQ(choose_supporting(grid, surfaces, 0.6), (std::vector<bool>{true, true}));
}

TEST(Surface, OfNothingIsEmptyAndSupportsNothing) {
  const auto scene = test::render_table({});
  const auto grid = make_grid(scene.cloud);
  const auto surface = make_surface(grid, std::vector<std::uint16_t>(grid.size(), 0), 1, scene.table(), 0.02);
  EXPECT_FALSE(surface.contains(grid.points[grid.size() / 2]));
  EXPECT_EQ(choose_supporting(grid, std::vector<Surface>{surface}, 0.6), std::vector<bool>{false});
}

}  // namespace
}  // namespace swarmfit::perception
