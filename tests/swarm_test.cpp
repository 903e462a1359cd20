// The parts of the swarm, each against what its equation says, and whole swarms on a landscape that is known.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "host/swarm/deflation.hpp"
#include "host/swarm/noise_scale.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/subset.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

TEST(Constriction, IsThatOfEquation1) {
  EXPECT_NEAR(constriction(2.1, 2.0), 0.7298, 5e-5);
  EXPECT_EQ(constriction(2.0, 2.0), 1.0);  // below c > 4 there is nothing to constrict
}

TEST(Roulette, SharesAreByImprovementOverTheWorst) {
  const double fitness[] = {10, 7, 9};  // improvements 0, 3, 1
  int drawn[3] = {};
  for (int k = 0; k < 4000; ++k) ++drawn[roulette(fitness, k / 4000.0)];
  EXPECT_EQ(drawn[0], 0);
  EXPECT_EQ(drawn[1], 3000);
  EXPECT_EQ(drawn[2], 1000);
}

TEST(Roulette, TakesTheNewestWhereAllAreEqual) {
  const double fitness[] = {5, 5, 5};
  EXPECT_EQ(roulette(fitness, 0.1), 2U);
}

TEST(Random, DependsOnThePlaceAndNotOnTheOrder) {
  const Random a(7), b(7), other(8);
  const auto late = a.words(Draw::move, 1, 2, 3);
  (void)b.words(Draw::sample, 9, 9, 9);
  EXPECT_EQ(late, b.words(Draw::move, 1, 2, 3));
  EXPECT_NE(late, other.words(Draw::move, 1, 2, 3));
  EXPECT_NE(late, a.words(Draw::sample, 1, 2, 3));
}

/// A cloud near the plane z = 0.
std::vector<double> slab(std::size_t n, double thickness) {
  std::vector<double> rows;
  const Random random(3);
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto w = random.words(Draw::subset, 5, 0, i);
    rows.insert(rows.end(), {Random::unit(w[0]) - 0.5, Random::unit(w[1]) - 0.5, thickness * (Random::unit(w[2]) - 0.5)});
  }
  return rows;
}

models::Position plane(double x, double y, double z, double offset) {
  models::Position p(4);
  p << Eigen::Vector3d(x, y, z).normalized(), offset;
  return p;
}

TEST(PlaneSpace, OppositeNormalsAreOnePlane) {
  const auto space = models::make_space(ModelType::plane, {});
  EXPECT_NEAR(space->distance(plane(0, 0, 1, 0.3), plane(0, 0, -1, -0.3)), 0, 1e-12);
}

TEST(PlaneSpace, DifferenceThenMoveArrives) {
  const auto space = models::make_space(ModelType::plane, {});
  const models::Position from = plane(0.2, -0.4, 1, 0.1), to = plane(-1, -0.3, -0.5, -0.7);
  models::Position at = from;
  Eigen::VectorXd velocity(4);
  space->difference(from, to, velocity);
  EXPECT_NEAR(velocity.head<3>().dot(from.head<3>()), 0, 1e-12) << "a velocity lies in the tangent plane";
  space->move(at, velocity);
  EXPECT_NEAR(space->distance(at, to), 0, 1e-9);
  EXPECT_NEAR(at.head<3>().norm(), 1, 1e-12);
  EXPECT_NEAR(velocity.head<3>().dot(at.head<3>()), 0, 1e-9) << "and is carried along";
}

TEST(PlaneSpace, PriorPullsBackToItsCone) {
  const double alpha = 0.2;
  const auto space = models::make_space(ModelType::plane, DirectionPrior{Eigen::Vector3d(0, 0, 2), alpha});
  models::Position tilted = plane(1, 0, 1, 0.25);
  ASSERT_TRUE(space->admit(tilted));
  EXPECT_NEAR(std::acos(std::abs(tilted[2])), alpha, 1e-9);
  models::Position flipped = plane(0.05, 0, -1, 0.25);
  ASSERT_TRUE(space->admit(flipped));
  EXPECT_GT(flipped[2], 0);
  EXPECT_NEAR(flipped[3], -0.25, 1e-12);
}

TEST(PlaneSpace, DegenerateSamplesAreRefused) {
  const std::vector<double> rows{0, 0, 0, 1, 1, 1, 2, 2, 2, 0, 1, 0};
  const models::WorkingPoints points(PointsView(std::span<const double>(rows), 3));
  const auto space = models::make_space(ModelType::plane, {});
  models::Position theta;
  const std::uint32_t line[] = {0, 1, 2}, same[] = {0, 0, 1}, good[] = {0, 1, 3};
  EXPECT_FALSE(space->from_sample(points, line, theta));
  EXPECT_FALSE(space->from_sample(points, same, theta));
  EXPECT_TRUE(space->from_sample(points, good, theta));
}

TEST(WorkingPoints, RankTellsPointLineAndPlane) {
  const auto rank = [](std::vector<float> rows) { return models::WorkingPoints(PointsView(std::span<const float>(rows), 3)).rank(); };
  EXPECT_EQ(rank({1, 2, 3, 1, 2, 3, 1, 2, 3}), 0);
  EXPECT_EQ(rank({0, 0, 0, 1.1F, 2.2F, 3.3F, 0.7F, 1.4F, 2.1F, 5.5F, 11, 16.5F}), 1);
  EXPECT_EQ(rank({0, 0, 0, 1, 0, 0, 0, 1, 0, 3, 4, 0}), 2);
  EXPECT_EQ(rank({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}), 3);
}

TEST(WorkingPoints, CountsOnlyFinitePoints) {
  const float nan = std::nanf("");
  const std::vector<float> rows{0, 0, 0, nan, 0, 0, 1, 0, 0, 0, INFINITY, 0, 0, 1, 0};
  const models::WorkingPoints points(PointsView(std::span<const float>(rows), 3));
  EXPECT_EQ(points.finite_count(), 3U);
  models::FiniteWalk walk = points.walk();
  EXPECT_EQ((std::vector<std::uint32_t>{walk.to(0), walk.to(1), walk.to(2)}), (std::vector<std::uint32_t>{0, 2, 4}));
  EXPECT_FALSE(points.finite(3));
}

TEST(WorkingPoints, WalksOverFullAndEmptyWords) {
  std::vector<float> rows(3 * 400, 1.0F);
  std::vector<std::uint32_t> finite;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const bool gone = (i >= 70 && i < 200) || (i > 320 && i % 3 == 0);
    rows[3 * i] = gone ? std::nanf("") : static_cast<float>(i);
    if (!gone) finite.push_back(i);
  }
  const models::WorkingPoints points(PointsView(std::span<const float>(rows), 3));
  ASSERT_EQ(points.finite_count(), finite.size());
  models::FiniteWalk every = points.walk(), some = points.walk();
  for (std::size_t place = 0; place < finite.size(); ++place) EXPECT_EQ(every.to(place), finite[place]);
  for (std::size_t place = 3; place < finite.size(); place += 37) EXPECT_EQ(some.to(place), finite[place]);
}

/// Fitness is the squared distance of the normal and the offset from a hidden plane: one optimum, known.
class Bowl final : public kernels::FitnessEvaluator {
 public:
  explicit Bowl(models::Position hidden) : hidden_(std::move(hidden)), space_(models::make_space(ModelType::plane, {})) {}
  const kernels::Identity& identity() const noexcept override { return identity_; }
  kernels::Support supports(const kernels::Workload&) const override { return {}; }
  kernels::Result<> set_points(const kernels::PointsView&) override { return {}; }
  kernels::Result<> set_caps(std::span<const float>) override { return {}; }
  kernels::Result<> evaluate(const kernels::SwarmView& swarm, kernels::Loss, std::span<const float>, std::span<float> costs) override {
    for (std::size_t j = 0; j < swarm.count; ++j) {
      const models::Position theta = Eigen::Map<const Eigen::VectorXd>(swarm.parameters.data() + 4 * j, 4);
      costs[j] = static_cast<float>(std::pow(space_->distance(theta, hidden_), 2));
    }
    return {};
  }
  kernels::Result<> distances(const kernels::ModelView&, std::span<float>) override { return {}; }
  kernels::Result<> assign(std::span<const kernels::ModelView>, std::span<const float>, std::span<std::uint16_t>) override { return {}; }
  kernels::Effort effort() const noexcept override { return {}; }

 private:
  kernels::Identity identity_{"bowl", "a known landscape"};
  models::Position hidden_;
  std::unique_ptr<models::ModelSpace> space_;
};

/// A swarm that starts on samples of a slab and flies over a bowl, which is asked in the data's frame.
struct OverBowl {
  OverBowl(const models::Position& hidden, const Settings& how, std::uint64_t seed) : bowl(hidden), settings(how), random(seed) {}

  std::vector<double> rows = slab(200, 1.0);
  models::WorkingPoints points{PointsView(std::span<const double>(rows), 3)};
  std::unique_ptr<models::ModelSpace> space = models::make_space(ModelType::plane, {});
  Bowl bowl;
  Settings settings;
  Random random;
  Subset subset{points, draw_part(points, random, kSearchedPart, 1000)};
  models::Neighbours none;
  Sampler sampler{points, subset.index(), none, *space, random};
  Landscape landscape{bowl, *space, points.frame(), settings};
  Swarm swarm{*space, settings, random};
};

class KnownLandscape : public testing::TestWithParam<Topology> {};

TEST_P(KnownLandscape, SwarmConvergesOnTheOptimum) {
  const models::Position hidden = plane(0.3, -0.2, 0.9, 0.05);
  Settings settings;
  settings.topology = GetParam();
  settings.iterations = 400;
  OverBowl over(hidden, settings, 11);
  Swarm& swarm = over.swarm;
  ASSERT_TRUE(swarm.start(over.sampler, 0, {}));
  double last = INFINITY;
  while (!swarm.converged() && swarm.steps() < settings.iterations) {
    ASSERT_TRUE(swarm.step(over.landscape, over.sampler, 1.0));
    EXPECT_LE(swarm.best_fitness(), last) << "the global best never worsens";
    EXPECT_LE(swarm.global_bests().size(), static_cast<std::size_t>(settings.roulette_length));
    last = swarm.best_fitness();
  }
  const models::Position found = over.space->to_data(swarm.best(), over.points.frame());
  EXPECT_LT(over.space->distance(found, hidden), 0.01);
}

TEST(Swarm, TheFittestStartersFlyOn) {
  Settings settings;
  settings.starters = 60;
  settings.particles = 12;
  OverBowl over(plane(0.3, -0.2, 0.9, 0.05), settings, 5);
  Swarm& swarm = over.swarm;
  ASSERT_TRUE(swarm.start(over.sampler, 0, {}));
  ASSERT_TRUE(swarm.step(over.landscape, over.sampler, 1.0));
  ASSERT_EQ(swarm.fitness().size(), 60U);
  ASSERT_EQ(swarm.positions().size(), 60U);
  std::vector<double> best(swarm.fitness().begin(), swarm.fitness().end());
  std::sort(best.begin(), best.end());
  best.resize(12);
  ASSERT_TRUE(swarm.step(over.landscape, over.sampler, 1.0));
  ASSERT_EQ(swarm.fitness().size(), 12U);
  ASSERT_EQ(swarm.own_bests().size(), 12U);
  // Each is as good as it was, or better.
  std::vector<double> now(swarm.own_fitness().begin(), swarm.own_fitness().end());
  for (const double fitness : now) EXPECT_LE(fitness, best.back());
  std::sort(now.begin(), now.end());
  for (std::size_t k = 0; k < best.size(); ++k) EXPECT_LE(now[k], best[k]);
}

TEST(Payment, AFittedModelsEmptyRingSaysNothingAmongMany) {
  // As the joint end makes them of 400 strewn correspondences: 30 close by, nobody just beyond, some everywhere else.
  Settings settings;
  settings.min_inliers = 15;
  Support strewn;
  strewn.unexplained = 400;
  strewn.slabs = {30, 5, 4, 2, 2, 2, 5};
  strewn.inner = 30;
  EXPECT_TRUE(pays(strewn, settings, 7));
  EXPECT_FALSE(pays_among_others(strewn, settings, 7));
  // A body of 80 pays either way, and one of too few points neither.
  Support body = strewn;
  body.slabs[0] = body.inner = 80;
  EXPECT_TRUE(pays(body, settings, 7));
  EXPECT_TRUE(pays_among_others(body, settings, 7));
  settings.min_inliers = 100;
  EXPECT_FALSE(pays_among_others(body, settings, 7));
}

TEST(Samples, WhatOneGetsHasNothingToDoWithWhoElseAsks) {
  // Correspondences at random: most samples are thrown away, so that several attempts are under way at once.
  std::mt19937 engine(4);
  std::uniform_real_distribution<double> unit(0, 500);
  std::vector<double> rows(4 * 60);
  for (double& value : rows) value = unit(engine);
  models::WorkingPoints points(PointsView(std::span<const double>(rows), 4));
  const auto space = models::make_space(ModelType::fundamental, {});
  const Random random(5);
  const Part part = look_closely(points, *space, random, kSampledFrom);
  const Sampler sampler(points, part.points.index(), part.neighbours, *space, random);
  std::vector<Sampler::Ask> asks;
  for (std::uint32_t k = 0; k < 40; ++k) asks.push_back({k, k % 2 == 0});
  std::vector<models::Position> together(asks.size());
  std::vector<std::uint8_t> drawn(asks.size());
  sampler.draw(asks, 1, 2, together, drawn);
  EXPECT_GT(std::count(drawn.begin(), drawn.end(), 1), 30);
  for (std::size_t k = 0; k < asks.size(); ++k) {
    models::Position alone;
    std::uint8_t found = 0;
    sampler.draw({&asks[k], 1}, 1, 2, {&alone, 1}, {&found, 1});
    ASSERT_EQ(found, drawn[k]) << k;
    if (found == 0) continue;
    EXPECT_EQ(alone, together[k]) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Both, KnownLandscape, testing::Values(Topology::roulette, Topology::ring));

TEST(Landscape, Equation5LessensTheFitnessAroundAnOptimum) {
  const models::Position hidden = plane(0, 0, 1, 0);
  const auto space = models::make_space(ModelType::plane, {});
  Bowl bowl(hidden);
  Settings settings;
  settings.deflation = Deflation::parametric;
  settings.lambda = 4;
  const models::Frame frame;
  Landscape landscape(bowl, *space, frame, settings);
  const models::Position near = plane(0.1, 0, 1, 0), optimum = plane(0.3, 0, 1, 0.2);
  const std::vector<models::Position> at{near};
  const std::vector<double> bests{INFINITY};
  std::vector<double> plain(1), deflated(1);
  ASSERT_TRUE(landscape.fitness(at, bests, plain));
  landscape.deflate_around(optimum);
  ASSERT_TRUE(landscape.fitness(at, bests, deflated));
  const double d = space->distance(near, optimum);
  EXPECT_NEAR(deflated[0] / plain[0], 4 * std::exp(-4 * d) + 1, 1e-9);
}

TEST(Deflation, TakesAllWithinReachAndNothingWellBeyond) {
  const float tau = 0.1F;
  const std::vector<float> distances{0.0F, 0.09F, 0.12F, 0.5F, std::nanf("")};
  std::vector<float> caps{0.1F, 0.1F, 0.1F, 0.05F, 0.0F};
  Near nowhere;
  deflate(distances, {.tau = tau, .slope = 2.0}, 0, caps, nowhere);
  EXPECT_FLOAT_EQ(caps[0], 0.0F);
  EXPECT_FLOAT_EQ(caps[1], 0.0F);
  EXPECT_NEAR(caps[2], 0.04F, 1e-6F);
  EXPECT_FLOAT_EQ(caps[3], 0.05F) << "a cap never rises";
  EXPECT_FLOAT_EQ(caps[4], 0.0F);
}

TEST(Deflation, ReachFollowsATailAndStopsAtAnEvenBackground) {
  const auto reach = [](double sigma, std::size_t background) {
    std::vector<float> distances;
    for (int k = 0; k < 5000; ++k) {  // quantiles of |N(0, sigma)|, by bisection of erf
      double low = 0, high = 8;
      for (int b = 0; b < 40; ++b) (std::erf((low + high) / 2 / std::numbers::sqrt2) < (k + 0.5) / 5000 ? low : high) = (low + high) / 2;
      distances.push_back(static_cast<float>(sigma * low));
    }
    for (std::size_t k = 0; k < background; ++k)
      distances.push_back(static_cast<float>(10.0 * static_cast<double>(k) / static_cast<double>(background)));
    const std::vector<float> ones(distances.size(), 1.0F);
    return tail_reach(count_support(distances, ones, 1.0F));
  };
  EXPECT_EQ(reach(0.4, 0), 1);
  EXPECT_EQ(reach(0.4, 20000), 1) << "an even background is no tail";
  EXPECT_GE(reach(1.5, 0), 3);
}

TEST(Deflation, ReachIsOneWhereThePlaneHasNoPointsOfItsOwn) {
  // A noisy floor, and a step beside it.
  constexpr float kTau = 0.1F;
  std::vector<double> rows;
  std::vector<float> distances;
  for (std::uint32_t k = 0; k < 4000; ++k) {
    const double x = (k % 80) / 40.0, y = (k / 80) / 50.0, z = k % 4 == 0 ? 0.15 : 0.05;
    rows.insert(rows.end(), {x, y, z});
  }
  for (std::uint32_t k = 0; k < 400; ++k) rows.insert(rows.end(), {2 + (k % 20) / 40.0, (k / 20) / 20.0, 0.15});
  for (std::size_t i = 2; i < rows.size(); i += 3) distances.push_back(static_cast<float>(rows[i]));
  const models::WorkingPoints points(PointsView(std::span<const double>(rows), 3));
  const std::vector<float> caps(distances.size(), kTau);
  const std::vector<float> reach = local_reach(points, Eigen::Vector3d::UnitZ(), distances, caps, kTau, 2);
  const auto ones = [&](std::size_t first, std::size_t last) {
    const auto at = [&](std::size_t i) { return reach.begin() + static_cast<std::ptrdiff_t>(i); };
    return std::count(at(first), at(last), 1.0F);
  };
  EXPECT_LE(ones(0, 4000), 80) << "the floor's tail, but for its rim";
  EXPECT_GE(ones(4000, 4400), 300) << "the step";
  std::vector<float> left = caps;
  Near nowhere;
  deflate(distances, {.tau = kTau, .reach = 2, .reaches = reach, .slope = 2.0}, 0, left, nowhere);
  EXPECT_EQ(left[0], 0.0F);
  for (std::size_t i = 4000; i < left.size(); ++i) EXPECT_NEAR(left[i], reach[i] == 1 ? 0.1F : 0.0F, 1e-6F) << i;
}

Support support(std::size_t inliers, std::size_t band, std::size_t unexplained) {
  Support s;
  s.unexplained = unexplained;
  s.slabs[0] = inliers;
  s.slabs[1] = band / 2;
  s.slabs[2] = band - band / 2;
  return s;
}

TEST(Payment, CountsUnexplainedPointsBySlabs) {
  const std::vector<float> distances{0.05F, 0.0F, 0.15F, 0.25F, 0.65F, 0.75F, 9.0F, std::nanf(""), 0.01F};
  const std::vector<float> caps{0.1F, 0.05F, 0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 0.049F};
  const Support s = count_support(distances, caps, 0.1F);
  EXPECT_EQ(s.unexplained, 7U);
  EXPECT_EQ(s.inliers(), 2U) << "a point whose cap has sunk below half is explained";
  EXPECT_EQ(s.band(), 2U);
  EXPECT_EQ(s.slabs[6], 1U);
  EXPECT_NEAR(s.square, 0.0025, 1e-6);
}

TEST(Payment, AModelOfTheBackgroundsDensityDoesNotPay) {
  Settings settings;
  settings.min_inliers = 10;
  EXPECT_FALSE(pays(support(50, 100, 1000), settings, 2)) << "as dense as what surrounds it";
  EXPECT_TRUE(pays(support(150, 100, 1000), settings, 2));
  EXPECT_FALSE(pays(support(9, 0, 1000), settings, 2)) << "fewer than min_inliers";
  EXPECT_LT(log_false_alarms(support(150, 100, 1000), 2), log_false_alarms(support(120, 100, 1000), 2));
}

TEST(Payment, AGapOnEitherSideFlattersNobody) {
  Settings settings;
  settings.min_inliers = 10;
  Support chance = support(30, 12, 270);  // among some 10 a slab, beside slabs that happen to be thin
  EXPECT_TRUE(pays(chance, settings, 2));
  for (std::size_t k = 3; k < Support::kSlabs; ++k) chance.slabs[k] = 10;
  EXPECT_FALSE(pays(chance, settings, 2));
}

TEST(Payment, TwoSurfacesSideBySidePayUnlessOneIsTheOthersLayer) {
  Settings settings;
  settings.min_inliers = 10;
  Support twin = support(120, 220, 1000);  // the other one fills the band
  EXPECT_FALSE(pays(twin, settings, 2)) << "no denser in its middle than towards its edge";
  twin.inner = 95;
  EXPECT_TRUE(pays(twin, settings, 2)) << "a peak of its own";
  twin.beside = 100;
  EXPECT_FALSE(pays(twin, settings, 2)) << "beside what has been found";
  const std::vector<float> distances{0.01F, 0.04F, 0.06F, 0.2F}, caps(4, 0.1F), found{0.5F, 0.8F, 0.1F, 0.1F};
  Near near{.beside = std::vector<std::uint8_t>(4)};
  std::vector<float> left = caps;
  deflate(found, {.tau = 0.1F, .slope = 2.0}, 0, left, near);
  const Support s = count_support(distances, caps, 0.1F, near.beside);
  EXPECT_EQ(s.inner, 2U);
  EXPECT_EQ(s.beside, 2U) << "of the first slab, those less than seven tau from a found model";
}

TEST(Payment, PointsSharedWithAFoundModelCountWhereTheyAreNearer) {
  Settings settings;
  settings.min_inliers = 100;
  Support s = support(85, 0, 1000);
  EXPECT_FALSE(pays(s, settings, 3));
  s.shared = 20;
  EXPECT_TRUE(pays(s, settings, 3));
  s.slabs[0] = 75;
  s.shared = 200;
  EXPECT_FALSE(pays(s, settings, 3)) << "too few of its own";
  const std::vector<float> distances{0.02F, 0.08F, 0.02F, 0.02F}, caps{0.0F, 0.0F, 0.1F, 0.0F}, found{0.05F, 0.05F, 0.5F, 0.2F};
  EXPECT_EQ(count_support(distances, caps, 0.1F, {}, {}, found).shared, 1U) << "explained, and nearer than what explains it";
}

TEST(NoiseScale, GaussianPartAmongUniformBackground) {
  const Random random(5);
  std::vector<float> distances;
  for (std::uint32_t i = 0; i < 4000; ++i) {
    const auto w = random.words(Draw::subset, 1, 1, i);
    const double radius = std::sqrt(-2 * std::log(1 - Random::unit(w[0])));
    distances.push_back(static_cast<float>(std::abs(0.02 * radius * std::cos(6.283185307179586 * Random::unit(w[1])))));
    if (i % 2 == 0) distances.push_back(static_cast<float>(0.3 * Random::unit(w[2])));
  }
  EXPECT_NEAR(gaussian_part(distances, 0.1, 0.3), 0.02, 0.001);
  EXPECT_EQ(gaussian_part({}, 0.1, 0.3), 0);
}

TEST(Subset, NeighbourhoodsAreThoseOfPointsThatSomethingIsLeftOf) {
  const Random random(3);
  std::vector<float> rows;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const auto w = random.words(Draw::subset, 7, 0, i);
    const double turn = 6.283 * Random::unit(w[0]);
    for (const double x : {std::cos(turn), std::sin(turn), 2 * Random::unit(w[1])}) rows.push_back(static_cast<float>(x));
  }
  models::WorkingPoints points{PointsView(std::span<const float>(rows), 3)}, all_of_them = points;
  const auto space = models::make_space(ModelType::cylinder, {});
  Part part = part_to_look_at(points, random, 600);
  ASSERT_TRUE(part.neighbours.empty());
  std::vector<float> left(part.points.index().size());
  for (std::size_t k = 0; k < left.size(); ++k) left[k] = k % 3 == 0 ? 0.0F : 0.01F;
  learn_neighbourhoods(part, points, *space, nullptr, left);
  const Part whole = look_closely(all_of_them, *space, random, 600);
  for (std::size_t k = 0; k < left.size(); ++k) {
    const std::uint32_t i = part.points.index()[k];
    ASSERT_EQ(whole.points.index()[k], i);
    const auto near = part.neighbours.of(k), expected = whole.neighbours.of(k);
    if (left[k] > 0) {
      EXPECT_TRUE(std::equal(near.begin(), near.end(), expected.begin(), expected.end()));
      EXPECT_EQ(points.normal(i), all_of_them.normal(i));
      EXPECT_FALSE(points.normal(i).isZero());
    } else {
      EXPECT_TRUE(std::all_of(near.begin(), near.end(), [&](std::uint32_t place) { return place == k; }));
      EXPECT_TRUE(points.normal(i).isZero());
    }
  }
}

TEST(Subset, CoversEvenlyAndKeepsNeighboursTogether) {
  const std::vector<double> rows = slab(5000, 0.01);
  const models::WorkingPoints points(PointsView(std::span<const double>(rows), 3));
  const Random random(1);
  const Subset part(points, draw_part(points, random, kSearchedPart, 500)), whole(points, draw_part(points, random, kSearchedPart, 10000));
  EXPECT_EQ(part.index().size(), 500U);
  EXPECT_EQ(whole.index().size(), 5000U);
  double along = 0, across = 0;
  for (std::size_t k = 1; k < part.index().size(); ++k) {
    along += (points.point<3>(part.index()[k]) - points.point<3>(part.index()[k - 1])).norm();
    across += (points.point<3>(part.index()[k]) - points.point<3>(part.index()[(k + 250) % 500])).norm();
  }
  EXPECT_LT(along, 0.3 * across);
}

TEST(Settings, StillStepsThatAreAskedForAreThoseOfAllSwarms) {
  FitOptions options;
  options.model = ModelType::line2d;
  EXPECT_GT(resolve(options, 1000, 0.01).eager_stall, 0) << "else the first swarms end sooner";
  options.stall = 7;
  const Settings asked = resolve(options, 1000, 0.01);
  EXPECT_EQ(asked.stall, 7);
  EXPECT_EQ(asked.eager_stall, 0);
}

}  // namespace
}  // namespace swarmfit::swarm
