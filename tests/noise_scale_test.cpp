// The threshold that the data themselves tell.
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/noise_scale.hpp"
#include "host/swarm/random.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit {
namespace {

/// Counts how often it is given points.
class Counting final : public kernels::FitnessEvaluator {
 public:
  explicit Counting(std::unique_ptr<kernels::FitnessEvaluator> inner) : inner_(std::move(inner)) {}
  const kernels::Identity& identity() const noexcept override { return inner_->identity(); }
  kernels::Support supports(const kernels::Workload& workload) const override { return inner_->supports(workload); }
  kernels::Result<> set_points(const kernels::PointsView& points) override {
    ++times;
    return inner_->set_points(points);
  }
  kernels::Result<> set_caps(std::span<const float> caps) override { return inner_->set_caps(caps); }
  kernels::Result<> evaluate(const kernels::SwarmView& swarm, kernels::Loss loss, std::span<const float> cutoffs,
                             std::span<float> costs) override {
    return inner_->evaluate(swarm, loss, cutoffs, costs);
  }
  // Nobody asks: points are weighed where they lie.
  kernels::Result<> distances(const kernels::ModelView&, std::span<float>) override { return kernels::fail({}, "distances"); }
  kernels::Result<> assign(std::span<const kernels::ModelView>, std::span<const float>, std::span<std::uint16_t>) override {
    return kernels::fail({}, "assign");
  }
  kernels::Effort effort() const noexcept override { return inner_->effort(); }

  int times = 0;

 private:
  std::unique_ptr<kernels::FitnessEvaluator> inner_;
};

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

/// Four stairs of 50 points each across the unit square, and `strewn` more points.
std::vector<double> stairs(unsigned seed, int strewn) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, kSigma);
  std::vector<double> xy;
  for (int i = 0; i < 200; ++i) {
    const double stair = i / 50;
    xy.push_back(0.25 * (stair + unit(rng)));
    xy.push_back(0.2 * (stair + 1) + noise(rng));
  }
  for (int i = 0; i < 2 * strewn; ++i) xy.push_back(unit(rng));
  return xy;
}

/// How many lines a fit to them finds, under an estimated threshold or this one.
std::size_t stairs_found(unsigned seed, int strewn, std::optional<double> threshold) {
  const std::vector<double> xy = stairs(seed, strewn);
  FitOptions options;
  options.model = ModelType::line2d;
  options.seed = seed;
  options.threshold = threshold;
  options.backend = "cpu";
  const auto result = fit(PointsView(std::span<const double>(xy), 2), options);
  EXPECT_TRUE(result) << result.error().message;
  return result ? result->models.size() : 0;
}

TEST(NoiseScale, FourNarrowStairsAreNotOneWideLine) {
  // One slab along the flight of stairs holds all of their points, and next to it there is nothing.
  int four = 0, fits = 0;
  for (const int strewn : {0, 20, 200}) {
    for (unsigned seed = 1; seed <= 12; ++seed, ++fits) four += stairs_found(seed, strewn, {}) == 4 ? 1 : 0;
  }
  EXPECT_GE(four, fits - 4) << "of " << fits << "; 17 where each line was weighed by itself";
}

TEST(FitLines, WhatPaysIsFoundBesideWhatSavesMore) {
  // A line along the flight of stairs saves more than a stair does, and does not pay: what is next to it is as dense.
  for (const int strewn : {100, 200, 400}) {
    for (unsigned seed = 1; seed <= 12; ++seed) EXPECT_EQ(stairs_found(seed, strewn, 2.5 * kSigma), 4U) << strewn << ", " << seed;
  }
}

TEST(FitLines, PointsStrewnEvenlyHaveNoModel) {
  // Many are looked at, and some have an empty gap on either side.
  constexpr unsigned kScenes = 100;
  for (const ModelType model : {ModelType::line2d, ModelType::circle2d}) {
    std::size_t invented = 0;
    for (unsigned seed = 1; seed <= kScenes; ++seed) {
      std::mt19937 rng(seed);
      std::uniform_real_distribution<double> unit(0, 1);
      std::vector<double> xy(2 * (60 + 10 * seed));
      for (double& v : xy) v = unit(rng);
      FitOptions options;
      options.model = model;
      options.seed = seed;
      options.threshold = 0.0125;
      options.backend = "cpu";
      const auto result = fit(PointsView(std::span<const double>(xy), 2), options);
      ASSERT_TRUE(result) << result.error().message;
      invented += result->models.size();
    }
    EXPECT_LE(invented, 1U) << name(model) << "; two and three where only what surrounds a model was chance";
  }
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

TEST(NoiseScale, PointsAreSetOnceForAllSearches) {
  const std::vector<double> xy = circles(1);
  FitOptions options;
  options.model = ModelType::circle2d;
  auto inner = kernels::make_cpu_evaluator({});
  ASSERT_TRUE(inner);
  Counting evaluator(std::move(*inner));
  models::WorkingPoints points(PointsView(std::span<const double>(xy), 2));
  const auto space = models::make_space(options.model, {});
  const swarm::Part part = swarm::look_closely(points, *space, swarm::Random(1), points.size());
  const auto scale = swarm::estimate_threshold(evaluator, points, part, points.finite_count(), options);
  ASSERT_TRUE(scale) << scale.error().message;
  EXPECT_EQ(evaluator.times, 1);
}

TEST(NoiseScale, WhatTheSearchForItCostIsNotTheFits) {
  const std::vector<double> xy = circles(1);
  FitOptions options;
  options.model = ModelType::circle2d;
  options.backend = "cpu";
  const auto estimated = fit(PointsView(std::span<const double>(xy), 2), options);
  ASSERT_TRUE(estimated) << estimated.error().message;
  ASSERT_GE(estimated->models.size(), 2U);
  // The first model came with the threshold: nothing is evaluated for it beside the straight lines that it must be better than.
  constexpr std::size_t kOfASwarm = 64, kSwarms = 4, kSteps = 3;
  EXPECT_LE(estimated->models.front().evaluations, kOfASwarm * kSwarms * kSteps);
}

}  // namespace
}  // namespace swarmfit
