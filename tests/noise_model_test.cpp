// Thresholds that follow a depth sensor's noise.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

#include "host/swarm/noise_model.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit {
namespace {

constexpr double kNoise = 0.0015;  // [1 / m] deviation of a depth, over its square

struct Room {
  std::vector<double> rows;
  std::vector<std::uint16_t> truth;  // 1 floor, 2 back wall, 3 side wall
};

/// What a camera at the origin, 1.2 m above the floor, sees of a room 6 m deep: rays through a 160 x 120 image, each depth with its noise.
Room room(unsigned seed, double unit = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kNoise);
  Room made;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const Eigen::Vector3d ray((u - 80) / 130.0, (v - 60) / 130.0, 1);
      const std::array<double, 3> depth{ray.y() > 0 ? 1.2 / ray.y() : 1e9, 6.0, ray.x() < 0 ? -1.5 / ray.x() : 1e9};
      const auto nearest = std::min_element(depth.begin(), depth.end());
      const Eigen::Vector3d point = ray * (*nearest + noise(random) * *nearest * *nearest) * unit;
      made.rows.insert(made.rows.end(), point.begin(), point.end());
      made.truth.push_back(static_cast<std::uint16_t>(nearest - depth.begin() + 1));
    }
  }
  return made;
}

Expected<FitResult> fit_room(const Room& room, Noise noise, std::string backend = "cpu", double threshold = 0.06, int threads = 0,
                             std::uint64_t seed = 1) {
  FitOptions options;
  options.threshold = threshold;
  options.noise = noise;
  options.backend = std::move(backend);
  options.threads = threads;
  options.seed = seed;
  return fit(PointsView(std::span<const double>(room.rows), 3), options);
}

/// Share of the points whose label is the one that most of their surface has, each label counting for one surface only.
double right_share(const Room& room, const FitResult& result) {
  std::map<std::pair<int, int>, std::size_t> votes;
  for (std::size_t i = 0; i < room.truth.size(); ++i) {
    if (result.labels[i] > 0) ++votes[{room.truth[i], result.labels[i]}];
  }
  std::size_t right = 0;
  std::set<int> used;
  for (int surface = 1; surface <= 3; ++surface) {
    std::size_t most = 0;
    int label = 0;
    for (const auto& [pair, count] : votes) {
      if (pair.first != surface || count < most || used.count(pair.second) > 0) continue;
      most = count;
      label = pair.second;
    }
    used.insert(label);
    right += most;
  }
  return static_cast<double>(right) / static_cast<double>(room.truth.size());
}

TEST(NoiseModel, SpreadIsOneAtTheNearEndAndGrowsWithTheSquare) {
  std::vector<double> rows{0, 0, 1, 0, std::numeric_limits<double>::quiet_NaN(), 9, 0, 0, -4, 0, 0, 6};
  for (int i = 0; i < 9; ++i) rows.insert(rows.end(), {0, 0, 2});
  const models::WorkingPoints points(PointsView(std::span<const double>(rows), 3));
  const double depth = swarm::near_depth(points);
  EXPECT_EQ(depth, 2);
  const std::vector<float> spread = swarm::spread_of(Noise::depth, points, depth);
  EXPECT_EQ(std::vector<float>(spread.begin(), spread.begin() + 5), (std::vector<float>{1, 1, 4, 9, 1}));
  EXPECT_TRUE(swarm::spread_of(Noise::none, points, depth).empty());
  EXPECT_TRUE(swarm::spread_of(Noise::depth, points, 0).empty()) << "all points in the camera's plane";
}

TEST(NoiseModel, APartIsDrawnByHowSteadyPointsAre) {
  std::vector<double> rows;
  std::vector<float> spread;
  for (int i = 0; i < 3000; ++i) {
    const bool hole = i % 30 == 7;
    rows.insert(rows.end(), {static_cast<double>(i), hole ? std::numeric_limits<double>::quiet_NaN() : 0.0, 1.0});
    spread.push_back(i % 3 == 0 ? 1.0F : i % 3 == 1 ? 2.0F : 10.0F);
  }
  const models::WorkingPoints points(PointsView(std::span<const double>(rows), 3));
  const swarm::Random random(3);
  const std::size_t asked = 800;
  const std::vector<std::uint32_t> drawn = swarm::draw_steady_part(points, random, 0, asked, spread);
  EXPECT_TRUE(std::is_sorted(drawn.begin(), drawn.end()));
  EXPECT_NEAR(static_cast<double>(drawn.size()), asked, 80);
  std::array<double, 3> of{};
  for (const std::uint32_t i : drawn) {
    EXPECT_TRUE(points.finite(i));
    of[i % 3] += 1;
  }
  // 1000, 900 and 1000 finite points: s (1000 + 900 / 2 + 1000 / 10) = 800.
  EXPECT_NEAR(of[0], 516, 60);
  EXPECT_NEAR(of[1], 232, 50);
  EXPECT_NEAR(of[2], 52, 25);
  // Where all steady ones are taken the rest is made up by the others: 1000 + s (900 / 2 + 1000 / 10) = 1700.
  const std::vector<std::uint32_t> more = swarm::draw_steady_part(points, random, 0, 1700, spread);
  EXPECT_EQ(std::count_if(more.begin(), more.end(), [](std::uint32_t i) { return i % 3 == 0; }), 1000);
  EXPECT_NEAR(static_cast<double>(more.size()), 1700, 80);
  EXPECT_EQ(swarm::draw_steady_part(points, random, 0, 5000, spread).size(), points.finite_count());
}

TEST(NoiseModel, FarSurfacesAreFoundWhole) {
  double with = 0, without = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Room seen = room(seed);
    const auto depth = fit_room(seen, Noise::depth), none = fit_room(seen, Noise::none);
    ASSERT_TRUE(depth) << depth.error().message;
    ASSERT_TRUE(none) << none.error().message;
    EXPECT_EQ(depth->models.size(), 3U) << depth->brief();
    with += right_share(seen, *depth) / 3;
    without += right_share(seen, *none) / 3;
  }
  EXPECT_GT(with, 0.95);
  EXPECT_GT(with, without + 0.1);
}

TEST(NoiseModel, ThresholdIsEstimatedForTheNearEnd) {
  const Room seen = room(4);
  FitOptions options;
  options.noise = Noise::depth;
  options.backend = "cpu";
  const auto result = fit(PointsView(std::span<const double>(seen.rows), 3), options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->models.size(), 3U) << result->brief();
  // Across the floor, which most of the near points lie on, a depth's noise is less than along it.
  EXPECT_GT(right_share(seen, *result), 0.8) << result->brief();
}

/// A corner of a room with boxes, the nearest of them at less than a fifth of the farthest depth, with a depth camera's noise.
std::vector<double> boxes(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, 1);
  struct Rectangle {
    Eigen::Vector3d at, along, up;
  };
  std::vector<Rectangle> faces{
      {{0, 1.2, 2.5}, {4, 0, 0}, {0, 0, 2.5}}, {{0, 0, 4.5}, {4, 0, 0}, {0, 2, 0}}, {{-2, 0, 2.5}, {0, 0, 2.5}, {0, 2, 0}}};
  for (int b = 0; b < 6; ++b) {
    const double turn = unit(random), size = 0.1 + 0.25 * unit(random);
    const Eigen::Vector3d x(std::cos(turn), 0, std::sin(turn)), y(0, 1, 0), z(-std::sin(turn), 0, std::cos(turn));
    const Eigen::Vector3d centre(1.6 * unit(random) - 0.8, 1.2 - size - (b == 0 ? 1.0 : 0.0), b == 0 ? 0.8 : 1.5 + 1.5 * unit(random));
    for (const auto& [n, u, v] : {std::tuple{x, y, z}, {y, z, x}, {z, x, y}}) {
      for (const double side : {-1.0, 1.0}) faces.push_back({centre + side * size * n, size * u, size * v});
    }
  }
  std::vector<double> rows;
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      const Eigen::Vector3d ray((u - 80) / 130.0, (v - 60) / 130.0, 1);
      double depth = 1e9;
      for (const Rectangle& face : faces) {
        const Eigen::Vector3d normal = face.along.cross(face.up);
        const double t = normal.dot(face.at) / normal.dot(ray);
        const Eigen::Vector3d off = t * ray - face.at;
        const bool inside = std::abs(off.dot(face.along)) < face.along.squaredNorm() && std::abs(off.dot(face.up)) < face.up.squaredNorm();
        if (t > 0.3 && inside) depth = std::min(depth, t);
      }
      if (depth > 1e8) continue;
      const Eigen::Vector3d point = ray * (depth + kNoise * depth * depth * noise(random));
      rows.insert(rows.end(), point.begin(), point.end());
    }
  }
  return rows;
}

TEST(NoiseModel, NoSlabThroughSeveralSurfacesIsTakenForNoise) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const std::vector<double> rows = boxes(seed);
    const PointsView view(std::span<const double>(rows), 3);
    const double depth = swarm::near_depth(models::WorkingPoints(view));
    FitOptions options;
    options.noise = Noise::depth;
    options.backend = "cpu";
    options.seed = seed;
    const auto result = fit(view, options);
    ASSERT_TRUE(result) << result.error().message;
    const double along_the_ray = 2.5 * kNoise * depth * depth;
    EXPECT_GT(result->threshold, 0.3 * along_the_ray) << "seed " << seed;
    EXPECT_LT(result->threshold, 2 * along_the_ray) << "seed " << seed;
  }
}

TEST(NoiseModel, IsTheSameOnEveryBackEndInEveryUnitOnAnyNumberOfThreads) {
  const Room seen = room(5), large = room(5, 1000);
  const auto base = fit_room(seen, Noise::depth, "cpu", 0.06, 1);
  ASSERT_TRUE(base);
  const auto agrees = [&](const Expected<FitResult>& other, double least) {
    ASSERT_TRUE(other) << other.error().message;
    std::size_t same = 0;
    for (std::size_t i = 0; i < base->labels.size(); ++i) same += other->labels[i] == base->labels[i] ? 1 : 0;
    EXPECT_GE(static_cast<double>(same), least * static_cast<double>(base->labels.size())) << other->brief();
  };
  agrees(fit_room(seen, Noise::depth, "cpu", 0.06, 2), 1);
  agrees(fit_room(large, Noise::depth, "cpu", 60), 0.999);
  agrees(fit_room(seen, Noise::depth, "reference"), 0.99);
}

TEST(NoiseModel, HoldsForThinnedCloudsAndPointsThatAreNotFinite) {
  Room seen = room(6);
  for (const unsigned seed : {7U, 8U}) {
    const Room more = room(seed);
    seen.rows.insert(seen.rows.end(), more.rows.begin(), more.rows.end());
    seen.truth.insert(seen.truth.end(), more.truth.begin(), more.truth.end());
  }
  for (std::size_t i = 0; i < seen.truth.size(); i += 7) seen.rows[3 * i + 2] = std::numeric_limits<double>::quiet_NaN();
  const auto result = fit_room(seen, Noise::depth);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->models.size(), 3U) << result->brief();
  for (std::size_t i = 0; i < seen.truth.size(); i += 7) EXPECT_EQ(result->labels[i], 0);
  EXPECT_GT(right_share(seen, *result), 0.95 * 6 / 7);
  std::size_t labelled = 0, inliers = 0;
  for (const std::uint16_t label : result->labels) labelled += label > 0 ? 1 : 0;
  for (const Model& model : result->models) {
    inliers += model.inliers;
    EXPECT_TRUE(model.covariance.allFinite());
    EXPECT_GT(model.rms, 0);
  }
  EXPECT_EQ(inliers, labelled);
}

TEST(NoiseModel, IsForPointsInSpace) {
  FitOptions options;
  options.model = ModelType::line2d;
  options.noise = Noise::depth;
  const auto refused = options.validate();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            "noise is depth, must be none for line2d: it is fitted to points of 2 columns, and depth is the third of 3");
  PerceiveOptions perceive;
  perceive.fit.noise = Noise::depth;
  EXPECT_FALSE(perceive.validate());
}

TEST(NoiseModel, HoldsWithEitherDeflationAndSeveralKinds) {
  const Room seen = room(9);
  FitOptions options;
  options.threshold = 0.03;
  options.noise = Noise::depth;
  options.backend = "cpu";
  options.rivals = {ModelType::sphere};
  const auto kinds = fit(PointsView(std::span<const double>(seen.rows), 3), options);
  ASSERT_TRUE(kinds) << kinds.error().message;
  EXPECT_GT(right_share(seen, *kinds), 0.9) << kinds->brief();
  options.rivals.clear();
  options.preset = Preset::paper;
  const auto paper = fit(PointsView(std::span<const double>(seen.rows), 3), options);
  ASSERT_TRUE(paper) << paper.error().message;
  EXPECT_FALSE(paper->models.empty());
}

}  // namespace
}  // namespace swarmfit
