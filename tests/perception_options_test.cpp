#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include <swarmfit/perception.hpp>

namespace swarmfit {
namespace {

void expect_invalid(const PerceiveOptions& options, const std::string& field, const std::string& bound) {
  const auto ok = options.validate();
  ASSERT_FALSE(ok) << field;
  EXPECT_EQ(ok.error().kind, Error::Kind::invalid_option);
  EXPECT_NE(ok.error().message.find(field + " is "), std::string::npos) << ok.error().message;
  EXPECT_NE(ok.error().message.find(bound), std::string::npos) << ok.error().message;
}

TEST(PerceiveOptions, DefaultsAreValid) { EXPECT_TRUE(PerceiveOptions{}.validate()); }

TEST(PerceiveOptions, EachFieldHasABound) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto with = [](auto change) {
    PerceiveOptions options;
    change(options);
    return options;
  };
  for (const double bad : {0.0, -1.0, nan, 1.6})
    expect_invalid(with([&](auto& o) { o.horizontal_angle = bad; }), "horizontal_angle", "(0, pi/2)");
  for (const double bad : {0.0, 1.0, nan}) expect_invalid(with([&](auto& o) { o.min_plane_share = bad; }), "min_plane_share", "(0, 1)");
  for (const double bad : {0.0, -1.0, nan, inf}) expect_invalid(with([&](auto& o) { o.min_height = bad; }), "min_height", "> 0");
  for (const double bad : {0.005, nan, inf}) expect_invalid(with([&](auto& o) { o.max_height = bad; }), "max_height", "> min_height");
  for (const double bad : {0.0, nan, inf}) expect_invalid(with([&](auto& o) { o.flood_step = bad; }), "flood_step", "> 0");
  for (const double bad : {0.99, nan, inf}) expect_invalid(with([&](auto& o) { o.soi_margin = bad; }), "soi_margin", ">= 1");
  for (const double bad : {-0.1, 1.0, nan}) expect_invalid(with([&](auto& o) { o.uncertain_cost = bad; }), "uncertain_cost", "[0, 1)");
  for (const double bad : {-1.0, nan, inf}) expect_invalid(with([&](auto& o) { o.smoothness = bad; }), "smoothness", ">= 0");
  for (const double bad : {2.0, nan}) expect_invalid(with([&](auto& o) { o.camera_tilt = bad; }), "camera_tilt", "[-pi/2, pi/2]");
  expect_invalid(with([&](auto& o) { o.colour_neighbours = -1; }), "colour_neighbours", ">= 0");
  expect_invalid(with([&](auto& o) { o.gravity = Eigen::Vector3d::Zero(); }), "gravity", "not zero");
  expect_invalid(with([&](auto& o) { o.gravity = Eigen::Vector3d(0, nan, 1); }), "gravity", "finite");
  expect_invalid(with([&](auto& o) { o.fit.model = ModelType::line2d; }), "model", "plane");
  expect_invalid(with([&](auto& o) { o.fit.rivals = {ModelType::sphere}; }), "fit.rivals", "empty");
  expect_invalid(with([&](auto& o) { o.fit.threshold = -1; }), "threshold", "> 0");
}

TEST(PerceiveOptions, OneSourceOfTheVertical) {
  PerceiveOptions options;
  options.gravity = Eigen::Vector3d(0, 1, 0);
  options.camera_tilt = 0.5;
  ASSERT_FALSE(options.validate());
  EXPECT_NE(options.validate().error().message.find("gravity and camera_tilt"), std::string::npos);
}

}  // namespace
}  // namespace swarmfit
