// Planes of clouds so large that swarms search a part of them: where surfaces meet, lie side by side, or cross.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <swarmfit/fit.hpp>

namespace swarmfit {
namespace {

constexpr double kTau = 0.01;

/// Rectangles strewn with points, in metres.
class Scene {
 public:
  /// `count` points of corner + s a + t b, s and t in [0, 1), off by Gaussian noise along the normal.
  void add(const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b, int count, double sigma) {
    const Eigen::Vector3d normal = a.cross(b).normalized();
    std::normal_distribution<double> noise(0, sigma);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int k = 0; k < count; ++k) {
      const double s = unit(engine_), t = unit(engine_);
      const Eigen::Vector3d p = corner + s * a + t * b + noise(engine_) * normal;
      for (int d = 0; d < 3; ++d) rows_.push_back(static_cast<float>(p[d]));
    }
  }
  FitResult fit(std::uint64_t seed) const {
    FitOptions options;
    options.threshold = kTau;
    options.backend = "cpu";
    options.seed = seed;
    auto result = swarmfit::fit(PointsView(std::span<const float>(rows_), 3), options);
    EXPECT_TRUE(result) << result.error().message;
    return result ? *result : FitResult{};
  }

 private:
  std::mt19937_64 engine_{7};
  std::vector<float> rows_;
};

/// Whether a model lies along the rectangle within `angle` [rad], and runs through its middle within half the threshold.
bool has(const FitResult& result, const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double angle = 0.1) {
  const Eigen::Vector3d normal = a.cross(b).normalized(), middle = corner + 0.5 * a + 0.5 * b;
  for (const Model& model : result.models) {
    const bool along = std::abs(model.normal().dot(normal)) > std::cos(angle);
    if (along && std::abs(model.normal().dot(middle) + model.offset()) < kTau / 2) return true;
  }
  return false;
}

// The low faces of a box on a table meet at an edge: a plane along both saves more than either, and is neither.
TEST(FitPlanes, TwoFacesThatMeetAreNoPlaneBetweenThem) {
  constexpr double kTurn = 0.65;
  const Eigen::Vector3d edge(0.4, 0.3, 0.1), along(0, 0.3, 0), one(0, 0, 0.05);
  const Eigen::Vector3d other(-0.05 * std::sin(kTurn), 0, -0.05 * std::cos(kTurn));
  Scene scene;
  scene.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 60000, 0.0015);
  scene.add(edge, along, one, 2600, 0.001);
  scene.add(edge, along, other, 2600, 0.001);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const FitResult result = scene.fit(seed);
    EXPECT_TRUE(has(result, edge, along, one)) << "seed " << seed;
    EXPECT_TRUE(has(result, edge, along, other)) << "seed " << seed;
    EXPECT_EQ(result.models.size(), 3U) << "seed " << seed;
  }
}

// A mat beside a floor whose noise comes near the threshold: as far from the floor's plane as the floor's own tail, but in a place of its
// own.
TEST(FitPlanes, WhatLiesBesideANoisySurfaceIsNotItsTail) {
  const Eigen::Vector3d mat(2, 0, 0.021), a(0.25, 0, 0), b(0, 1, 0);
  Scene scene;
  scene.add({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 60000, 0.009);
  scene.add(mat, a, b, 6000, 0.003);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const FitResult result = scene.fit(seed);
    EXPECT_TRUE(has(result, mat, a, b)) << "seed " << seed;
    EXPECT_LE(result.models.size(), 3U) << "seed " << seed;
  }
}

// Noise of a surface is seldom taken for surfaces of their own, and the surface never apart.
TEST(FitPlanes, ANoisySurfaceHasFewLayers) {
  for (const double sigma : {0.004, 0.008, 0.025}) {
    Scene scene;
    scene.add({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 60000, sigma);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const FitResult result = scene.fit(seed);
      EXPECT_LE(result.models.size(), sigma < kTau ? 1U : 3U) << "sigma " << sigma << ", seed " << seed;
      for (const Model& model : result.models) EXPECT_GT(std::abs(model.normal().z()), 0.99) << "sigma " << sigma << ", seed " << seed;
    }
  }
}

// Where a small plane crosses a large one, part of its points are within the threshold of both; to which they are nearer, they belong.
TEST(FitPlanes, PointsThatPlanesShareCountForTheNearer) {
  const Eigen::Vector3d at(0.5, 0.3, -0.05), a(0, 0.4, 0), b(0, 0, 0.1);
  constexpr int kPoints = 590;  // of 50590; a quarter are within 1.25 thresholds of the large plane, and 506 is a hundredth
  Scene scene;
  scene.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 50000, 0.001);
  scene.add(at, a, b, kPoints, 0.001);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) EXPECT_TRUE(has(scene.fit(seed), at, a, b)) << "seed " << seed;
}

}  // namespace
}  // namespace swarmfit
