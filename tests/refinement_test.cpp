// Refinement never worsens what it refines.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::swarm {
namespace {

constexpr float kTau = 0.03F;

/// Two crossing lines with noise, and outliers, in the unit square.
std::vector<double> crossing_lines() {
  const Random random(17);
  std::vector<double> rows;
  for (std::uint32_t i = 0; i < 600; ++i) {
    const auto w = random.words(Draw::subset, 2, 0, i);
    const double u = Random::unit(w[0]), v = Random::unit(w[1]);
    const double noise = 0.01 * (Random::unit(w[2]) + Random::unit(w[3]) - 1);
    if (i % 3 == 0) rows.insert(rows.end(), {u, 0.4 + 0.2 * u + noise});
    if (i % 3 == 1) rows.insert(rows.end(), {u, 0.6 - 0.3 * u + noise});
    if (i % 3 == 2) rows.insert(rows.end(), {u, v});
  }
  return rows;
}

class Refinement : public testing::Test {
 protected:
  void SetUp() override {
    evaluator_ = std::move(*kernels::make_reference_evaluator());
    ASSERT_TRUE(evaluator_->set_points(points_.view()));
    caps_.assign(points_.size(), kTau);
    ASSERT_TRUE(evaluator_->set_caps(caps_));
  }
  /// A line a little off y = a + b x.
  models::Position off(double a, double b, double turn, double shift) const {
    Eigen::VectorXd data(3);
    const double angle = std::atan(b) + turn;
    data << -std::sin(angle), std::cos(angle), 0;
    data[2] = -(data[0] * 0.5 + data[1] * (a + b * 0.5)) + shift;
    return space_->from_data(data, points_.frame());
  }
  /// Sum of min(tau, distance to the nearest), straight from the reference.
  double energy(const std::vector<models::Placed>& lines) {
    std::vector<float> least = caps_, distances(points_.size());
    for (const auto& [space, line] : lines) {
      const Eigen::VectorXd data = space_->to_data(line, points_.frame());
      EXPECT_TRUE(evaluator_->distances({space_->kind(), std::span<const double>(data.data(), 3)}, distances));
      for (std::size_t i = 0; i < least.size(); ++i) least[i] = std::min(least[i], distances[i]);
    }
    double sum = 0;
    for (const float v : least) sum += static_cast<double>(v);
    return sum;
  }

  const std::vector<double> rows_ = crossing_lines();
  const models::WorkingPoints points_{PointsView(std::span<const double>(rows_), 2)};
  const std::unique_ptr<models::ModelSpace> space_ = models::make_space(ModelType::line2d, {});
  std::unique_ptr<kernels::FitnessEvaluator> evaluator_;
  std::vector<float> caps_;
  const Settings settings_;
};

TEST_F(Refinement, OneModelComesCloserAndItsLossNeverRises) {
  Landscape landscape(*evaluator_, *space_, points_.frame(), settings_);
  const Ground ground{*evaluator_, *space_, points_, kTau};
  const models::Position truth = off(0.4, 0.2, 0, 0);
  for (const double turn : {-0.03, -0.01, 0.02, 0.3}) {
    models::Position line = off(0.4, 0.2, turn, 0.008);
    const double before = *landscape.loss(line), away = space_->distance(line, truth);
    const auto loss = refine_one(ground, Loss::truncated_l1, caps_, line);
    ASSERT_TRUE(loss);
    EXPECT_LE(*loss, before + 1e-6);
    EXPECT_NEAR(*loss, *landscape.loss(line), 1e-5) << "the loss told is that of the line returned";
    if (std::abs(turn) < 0.1) {
      EXPECT_LT(space_->distance(line, truth), 0.5 * away);
    }
  }
}

TEST_F(Refinement, PointsAlreadyExplainedAreLeftOut) {
  const Ground ground{*evaluator_, *space_, points_, kTau};
  const std::vector<float> nothing_left(caps_.size(), 0.0F);
  models::Position line = off(0.4, 0.2, 0.02, 0.008);
  const models::Position before = line;
  ASSERT_TRUE(refine_one(ground, Loss::truncated_l1, nothing_left, line));
  EXPECT_EQ(line, before);
}

TEST_F(Refinement, JointEnergyNeverRises) {
  const Ground ground{*evaluator_, *space_, points_, kTau};
  for (const double turn : {-0.03, 0.0, 0.02, 0.2}) {
    std::vector<models::Placed> lines{{space_.get(), off(0.4, 0.2, turn, 0.01)}, {space_.get(), off(0.6, -0.3, -turn, -0.005)}};
    const double before = energy(lines);
    const auto told = refine_jointly(ground, lines);
    ASSERT_TRUE(told);
    EXPECT_LE(*told, before + 1e-6);
    EXPECT_NEAR(*told, energy(lines), 1e-6);
  }
}

TEST_F(Refinement, UniqueSupportOfTwinsIsNothing) {
  const Ground ground{*evaluator_, *space_, points_, kTau};
  const models::Position line = off(0.4, 0.2, 0, 0), twin = off(0.4, 0.2, 1e-5, 0), other = off(0.6, -0.3, 0, 0);
  const auto unique =
      unique_support(ground, std::vector<models::Placed>{{space_.get(), line}, {space_.get(), twin}, {space_.get(), other}});
  ASSERT_TRUE(unique);
  EXPECT_LT((*unique)[0], 3U);
  EXPECT_LT((*unique)[1], 3U);
  EXPECT_GT((*unique)[2], 100U);
}

TEST_F(Refinement, WhatOthersLeaveIsTheDistanceToTheNearestOfThem) {
  std::vector<double> rows = rows_;
  for (const std::size_t hole : {0U, 7U, 599U}) rows[2 * hole] = std::nan("");
  const models::WorkingPoints points{PointsView(std::span<const double>(rows), 2)};
  const Ground ground{*evaluator_, *space_, points, kTau};
  const auto circle = models::make_space(ModelType::circle2d, {});
  const std::vector<models::Placed> models{{space_.get(), space_->from_data(Eigen::Vector3d(0, 1, -0.5), points.frame())},
                                           {circle.get(), circle->from_data(Eigen::Vector3d(0.5, 0.5, 0.2), points.frame())},
                                           {space_.get(), space_->from_data(Eigen::Vector3d(1, 0, -0.3), points.frame())}};
  const auto distances = measure(ground, models);
  const auto nearest = TwoNearest::of(ground, models);
  ASSERT_TRUE(distances && nearest);
  for (std::size_t m = 0; m < models.size(); ++m) {
    std::vector<float> left(points.size(), -1.0F);
    nearest->left_by_others(ground, m, left);
    for (std::size_t i = 0; i < left.size(); ++i) {
      float expected = points.finite(i) ? kTau : 0.0F;
      for (std::size_t other = 0; other < models.size(); ++other) {
        if (other != m && points.finite(i)) expected = std::min(expected, (*distances)[other][i]);
      }
      ASSERT_EQ(left[i], expected) << "model " << m << ", point " << i;
    }
  }
}

TEST_F(Refinement, AloneNothingIsLeftByOthers) {
  const Ground ground{*evaluator_, *space_, points_, kTau};
  const auto nearest = TwoNearest::of(ground, std::vector<models::Placed>{{space_.get(), off(0.4, 0.2, 0, 0)}});
  ASSERT_TRUE(nearest);
  std::vector<float> left(points_.size());
  nearest->left_by_others(ground, 0, left);
  EXPECT_EQ(left, caps_);
}

TEST(Distances, OfARunAreThoseOfAPassOverAll) {
  // An image's holes lie elsewhere in the run than at the cloud's start.
  constexpr std::size_t kFirst = 2048;
  std::vector<float> rows;
  for (std::size_t i = 0; i < 2 * kFirst; ++i) {
    const bool hole = i < kFirst ? i / 64 % 2 == 0 : i / 64 % 3 == 0;
    const auto t = static_cast<float>(i);
    rows.insert(rows.end(), {hole ? std::nanf("") : t, std::sin(t)});
  }
  kernels::EvaluatorOptions options;
  options.threads = 1;
  const auto cpu = std::move(*kernels::make_cpu_evaluator(options));
  const models::WorkingPoints points{PointsView(std::span<const float>(rows), 2)};
  const auto space = models::make_space(ModelType::line2d, std::nullopt);
  const Ground ground{.evaluator = *cpu, .space = *space, .points = points, .tau = 0.5F};
  const models::Position line = space->from_data(Eigen::Vector3d(0, 1, 0.1), points.frame());
  std::vector<float> all(points.size()), run(kFirst);
  ASSERT_TRUE(weigh(ground, line, {}, all));
  ASSERT_TRUE(tell_distances(ground, line, kFirst, run));
  for (std::size_t i = 0; i < run.size(); ++i) {
    ASSERT_EQ(std::isnan(run[i]), !points.finite(kFirst + i)) << i;
    if (points.finite(kFirst + i)) {
      ASSERT_EQ(run[i], all[kFirst + i]) << i;
    }
  }
}

}  // namespace
}  // namespace swarmfit::swarm
