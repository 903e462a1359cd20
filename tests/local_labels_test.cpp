// Labels by the density of a model's points nearby.
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/fit.hpp>

#include "host/models/working_points.hpp"
#include "host/swarm/local_labels.hpp"
#include "kernels/reused.hpp"

namespace swarmfit {
namespace {

constexpr double kSigma = 0.005;
constexpr float kTau = 2.5F * static_cast<float>(kSigma);

struct Scene {
  std::vector<double> xy;
  std::vector<std::uint16_t> truth;

  void add(double x, double y, std::uint16_t label) {
    xy.insert(xy.end(), {x, y});
    truth.push_back(label);
  }
  PointsView view() const { return {std::span<const double>(xy), 2}; }
  double wrong(const std::vector<std::uint16_t>& labels) const {
    double n = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) n += labels[i] != truth[i] ? 1 : 0;
    return n / static_cast<double>(truth.size());
  }
};

/// Half a line, y = 0.5 from x = 0 to 0.5, and outliers all over the unit square.
Scene half_a_line(std::size_t outliers, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, kSigma);
  Scene scene;
  for (int i = 0; i < 100; ++i) scene.add(0.5 * unit(rng), 0.5 + noise(rng), 1);
  for (std::size_t i = 0; i < outliers; ++i) scene.add(unit(rng), unit(rng), 0);
  return scene;
}

std::vector<float> from_level(const Scene& scene, double y) {
  std::vector<float> distances;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) distances.push_back(static_cast<float>(std::abs(scene.xy[2 * i + 1] - y)));
  return distances;
}

TEST(LocalLabels, OutliersBeyondTheEndOfASegmentAreNotItsOwn) {
  double beyond = 0, denied = 0, within = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Scene scene = half_a_line(700, seed);
    const auto distances = from_level(scene, 0.5);
    const auto labels = swarm::label_locally(models::WorkingPoints(scene.view()), std::vector<kernels::Reused<float>>{distances}, kTau);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (!(distances[i] <= kTau)) {
        EXPECT_EQ(labels[i], 0);
        continue;
      }
      if (scene.xy[2 * i] > 0.6) {
        ++beyond;
        denied += labels[i] == 0 ? 1 : 0;
      }
      if (scene.truth[i] == 1) within += labels[i] == 1 ? 1 : 0;
    }
  }
  EXPECT_GT(beyond, 50);
  EXPECT_GT(denied, 0.85 * beyond);
  EXPECT_GT(within, 0.93 * 1000);
}

TEST(LocalLabels, AModelThatIsAsDenseAllAlongIsLabelledAsAWhole) {
  double local = 0, whole = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> noise(0, kSigma);
    Scene scene;
    for (int i = 0; i < 60; ++i) scene.add(unit(rng), 0.5 + noise(rng), 1);
    for (int i = 0; i < 200; ++i) scene.add(unit(rng), unit(rng), 0);
    const auto distances = from_level(scene, 0.5);
    local += scene.wrong(swarm::label_locally(models::WorkingPoints(scene.view()), std::vector<kernels::Reused<float>>{distances}, kTau));
    // Bayes' rule with the true densities: 60 N(d; 0, sigma) of its own against 200.
    const double reach = kSigma * std::sqrt(2 * std::log(60 / (200 * kSigma * std::sqrt(2 * std::numbers::pi))));
    std::vector<std::uint16_t> best;
    for (const float d : distances) best.push_back(static_cast<double>(d) <= reach ? 1 : 0);
    whole += scene.wrong(best);
  }
  EXPECT_LT(local, 1.012 * whole);
}

TEST(LocalLabels, WithoutOutliersAllWithinTheThresholdAreOwned) {
  const Scene scene = half_a_line(0, 1);
  const auto distances = from_level(scene, 0.5);
  const auto labels = swarm::label_locally(models::WorkingPoints(scene.view()), std::vector<kernels::Reused<float>>{distances}, kTau);
  for (std::size_t i = 0; i < labels.size(); ++i) EXPECT_EQ(labels[i], distances[i] <= kTau ? 1 : 0) << i;
}

TEST(LocalLabels, TheNearerOfTwoModelsOwnsWhatBothClaim) {
  Scene scene = half_a_line(0, 2);
  const std::size_t one = scene.truth.size();
  for (std::size_t i = 0; i < one; ++i) scene.add(scene.xy[2 * i], scene.xy[2 * i + 1] + 2 * kSigma, 2);
  const std::vector<kernels::Reused<float>> distances{from_level(scene, 0.5), from_level(scene, 0.5 + 2 * kSigma)};
  const auto labels = swarm::label_locally(models::WorkingPoints(scene.view()), distances, kTau);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == 0) continue;
    EXPECT_LE(distances[labels[i] - 1U][i], distances[2U - labels[i]][i]) << i;
  }
}

TEST(LocalLabels, AFitOfFewPointsLabelsByThem) {
  double local = 0, by_threshold = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Scene scene = half_a_line(700, seed);
    FitOptions options;
    options.model = ModelType::line2d;
    options.threshold = static_cast<double>(kTau);
    options.seed = seed;
    options.backend = "cpu";
    const auto result = fit(scene.view(), options);
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), 1U);
    std::size_t owned = 0;
    std::vector<std::uint16_t> nearest;
    const Eigen::VectorXd& line = result->models[0].parameters;
    for (std::size_t i = 0; i < scene.truth.size(); ++i) {
      owned += result->labels[i] == 1 ? 1 : 0;
      const double d = std::abs(line[0] * scene.xy[2 * i] + line[1] * scene.xy[2 * i + 1] + line[2]);
      nearest.push_back(d <= static_cast<double>(kTau) ? 1 : 0);
    }
    EXPECT_EQ(result->models[0].inliers, owned);
    local += scene.wrong(result->labels);
    by_threshold += scene.wrong(nearest);
  }
  EXPECT_LT(local, 0.75 * by_threshold);
}

}  // namespace
}  // namespace swarmfit
