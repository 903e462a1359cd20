// The threshold that the data themselves tell.
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/fit.hpp>

namespace swarmfit {
namespace {

constexpr double kSigma = 0.0075;

/// Five circles of 50 points each among as many outliers.
std::vector<double> circles(unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, kSigma);
  std::vector<double> xy;
  for (int k = 0; k < 5; ++k) {
    const double radius = 0.2 + 0.4 * unit(rng), x = 1.2 * unit(rng) - 0.6, y = 1.2 * unit(rng) - 0.6;
    for (int i = 0; i < 50; ++i) {
      const double angle = 2 * std::numbers::pi * unit(rng);
      xy.push_back(x + radius * std::cos(angle) + noise(rng));
      xy.push_back(y + radius * std::sin(angle) + noise(rng));
    }
  }
  for (int i = 0; i < 250; ++i) {
    xy.push_back(2.4 * unit(rng) - 1.2);
    xy.push_back(2.4 * unit(rng) - 1.2);
  }
  return xy;
}

TEST(NoiseScale, CirclesAmongOutliersSeldomMisleadIt) {
  constexpr int kScenes = 100;
  int near = 0;
  for (unsigned seed = 1; seed <= kScenes; ++seed) {
    const std::vector<double> xy = circles(seed);
    FitOptions options;
    options.model = ModelType::circle2d;
    options.seed = seed;
    options.backend = "cpu";
    const auto result = fit(PointsView(std::span<const double>(xy), 2), options);
    ASSERT_TRUE(result) << result.error().message;
    const double sigmas = result->threshold / kSigma;
    near += sigmas > 0.75 * 2.5 && sigmas < 1.25 * 2.5 ? 1 : 0;
  }
  EXPECT_GE(near, kScenes - 3);
}

}  // namespace
}  // namespace swarmfit
