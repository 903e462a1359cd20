#include <gtest/gtest.h>

#include "host/perception/vertical.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit::perception {
namespace {

const auto plane = test::plane_model;

/// Views of a camera at the origin; the cloud only tells where the image's bottom is.
PointGrid view(double y_sign = 1, double z_sign = 1) {
  Cloud cloud;
  cloud.width = 32;
  cloud.height = 24;
  for (int v = 0; v < 24; ++v)
    for (int u = 0; u < 32; ++u)
      for (const double value : {(u - 15.5) / 30, y_sign * (v - 11.5) / 30, z_sign}) cloud.values32.push_back(static_cast<float>(value));
  return make_grid(cloud);
}

TEST(Vertical, GravityPointsDownAndItsLengthDoesNotMatter) {
  const auto vertical = vertical_from_gravity({0, 9.81, 0});
  EXPECT_TRUE(vertical.up.isApprox(Eigen::Vector3d(0, -1, 0)));
  EXPECT_EQ(vertical.source, "gravity");
}

TEST(Vertical, TiltTurnsTheCameraDown) {
  EXPECT_TRUE(vertical_from_tilt(0).up.isApprox(Eigen::Vector3d(0, -1, 0)));
  EXPECT_TRUE(vertical_from_tilt(1.5707963267948966).up.isApprox(Eigen::Vector3d(0, 0, -1), 1e-9));
  const auto rendering = test::render_table({});
  EXPECT_TRUE(vertical_from_tilt(0.733).up.isApprox(rendering.up, 1e-9));
}

TEST(Vertical, TheLargestPlaneIsTheGroundAndFacesTheCamera) {
  const auto grid = view();
  const auto vertical = vertical_from_planes(grid, std::vector<Model>{plane({0, 0.8, 0.6}, -0.6, 1000)}, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_TRUE(vertical->up.isApprox(Eigen::Vector3d(0, -0.8, -0.6)));
  EXPECT_EQ(vertical->source, "dominant plane");
}

TEST(Vertical, ALargerWallBehindTheDeskIsNotTheGround) {
  const auto grid = view();
  // Camera tilted 30 degrees down; the wall's normal leans to the image's bottom.
  const auto desk = plane({0, -0.866, -0.5}, 0.6, 1000), wall = plane({0, 0.5, -0.866}, 2, 3000);
  const auto vertical = vertical_from_planes(grid, std::vector<Model>{wall, desk}, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_TRUE(vertical->up.isApprox(desk.normal()));
}

TEST(Vertical, PlanesThatShareADirectionOutweighASingleLargerOne) {
  const auto grid = view();
  const std::vector<Model> planes{plane({-0.3, -0.6, -0.7}, 1, 1500), plane({0, -0.9, -0.43}, 1, 1000), plane({0, -0.9, -0.43}, 1.4, 900)};
  const auto vertical = vertical_from_planes(grid, planes, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_TRUE(vertical->up.isApprox(planes[1].normal()));
}

TEST(Vertical, TheLargestOfADirectionTellsItThoughASmallerLiesAmidMore) {
  const auto grid = view();
  // 6 degrees apart each: within 0.2 rad of the small one lie both others, of the floor only that.
  const std::vector<Model> planes{plane({0, -0.84, -0.543}, 1.2, 20000), plane({0, -0.777, -0.629}, 0.8, 3000),
                                  plane({0, -0.706, -0.708}, 1.4, 2000)};
  const auto vertical = vertical_from_planes(grid, planes, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_TRUE(vertical->up.isApprox(planes[0].normal(), 1e-3));
}

TEST(Vertical, ACameraFrameWithYUpAndZBackwards) {
  const auto grid = view(-1, -1);
  const auto desk = plane({0, 0.8, 0.6}, 0.5, 1000), wall = plane({0, -0.6, 0.8}, 2, 2500);
  const auto vertical = vertical_from_planes(grid, std::vector<Model>{wall, desk}, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_TRUE(vertical->up.isApprox(desk.normal()));
}

TEST(Vertical, WithWallsAloneTheImageTellsUp) {
  const auto grid = view();
  const std::vector<Model> planes{plane({0, 0.05, -1}, 2, 3000), plane({-1, 0, -0.1}, 1, 1000)};
  const auto vertical = vertical_from_planes(grid, planes, 0.2);
  ASSERT_TRUE(vertical);
  EXPECT_EQ(vertical->source, "dominant plane (a wall)");
  EXPECT_GT(-vertical->up.y(), 0.99);
  EXPECT_NEAR(vertical->up.dot(planes[0].normal()), 0, 1e-9);
}

TEST(Vertical, NoPlaneNoVertical) { EXPECT_FALSE(vertical_from_planes(view(), {}, 0.2)); }

TEST(Vertical, IsDecidedOnceWhatIsLeftCannotOutvoteTheGround) {
  const auto grid = view();
  const auto desk = plane({0, -0.8, -0.6}, 0.6, 1000), front = plane({0, 0.6, -0.8}, 1, 300), board = plane({0, -0.8, -0.6}, 0.9, 200);
  const auto decided = [&](const std::vector<Model>& planes, std::size_t left) { return is_vertical_decided(grid, planes, left, 0.2); };
  EXPECT_TRUE(decided({desk}, 999));
  EXPECT_FALSE(decided({desk}, 1000));
  EXPECT_TRUE(decided({desk, board}, 999)) << "a plane of its direction does not speak against it";
  // One that leans to the image's bottom hardly counts; upright it would.
  EXPECT_TRUE(decided({front, desk}, 900));
  EXPECT_FALSE(decided({plane({0, -0.4, -0.9}, 1, 300), desk}, 900));
  // What may as well be a wall waits for what is beside it.
  EXPECT_FALSE(decided({plane({0, 0, -1}, 2, 1000)}, 0));
  EXPECT_FALSE(decided({}, 0));
  // And nothing that comes later changes it: the same vertical with another plane of all that is left.
  const auto alone = vertical_from_planes(grid, std::vector<Model>{desk}, 0.2),
             outvoted = vertical_from_planes(grid, std::vector<Model>{desk, plane({-0.3, -0.6, -0.7}, 1, 999)}, 0.2);
  ASSERT_TRUE(alone && outvoted);
  EXPECT_TRUE(alone->up.isApprox(outvoted->up));
}

}  // namespace
}  // namespace swarmfit::perception
