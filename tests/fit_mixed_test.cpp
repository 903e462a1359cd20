// Several kinds in one call compete for the same points, and what is flat is not taken for something curved.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <swarmfit/fit.hpp>

#include "tests/same_answer.hpp"

namespace swarmfit {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kRadius[] = {0.04, 0.07, 0.06, 0.09};  // of two cylinders and two spheres [m]
constexpr double kNoise = 0.002;                        // sigma, along the normal [m]

/// A table and what stands on it, seen from all sides, with uniform outliers. Labels: 0 outlier, 1 table, then as kRadius.
class Scene {
 public:
  explicit Scene(std::uint64_t seed) : engine_(seed) {}

  void table(std::size_t count, std::uint16_t label = 1) {
    for (std::size_t i = 0; i < count; ++i) add(Vector(uniform(-0.6, 0.6), uniform(-0.4, 0.4), noise()), label);
  }
  void cylinder(const Vector& foot, double radius, double height, std::size_t count, std::uint16_t label) {
    for (std::size_t i = 0; i < count; ++i) {
      const double turn = uniform(0, 2 * std::numbers::pi), r = radius + noise();
      add(foot + Vector(r * std::cos(turn), r * std::sin(turn), uniform(0, height)), label);
    }
  }
  /// As seen from afar along x, with so many points that trail off behind its edges.
  void half_cylinder(const Vector& foot, double radius, double height, std::size_t count, std::size_t trailing, std::uint16_t label) {
    const auto at = [&](double turn, double r) -> Vector {
      return foot + Vector(r * std::cos(turn), r * std::sin(turn), uniform(0, height));
    };
    for (std::size_t i = 0; i < count; ++i) add(at(uniform(-1.3, 1.3), radius + noise()), label);
    for (std::size_t i = 0; i < trailing; ++i) {
      const double turn = i % 2 == 0 ? uniform(1.25, 1.35) : uniform(-1.35, -1.25);
      add(at(turn, radius + uniform(0, 0.01)) - Vector(uniform(0, 0.02), 0, 0), 0);
    }
  }
  void sphere(const Vector& centre, double radius, std::size_t count, std::uint16_t label) {
    for (std::size_t i = 0; i < count; ++i) {
      const double z = uniform(-1, 1), turn = uniform(0, 2 * std::numbers::pi), flat = std::sqrt(1 - z * z);
      add(centre + (radius + noise()) * Vector(flat * std::cos(turn), flat * std::sin(turn), z), label);
    }
  }
  /// The five faces that stand free; axes along the table's.
  void box(const Vector& foot, const Vector& size, double per_area) {
    const Vector low = foot - Vector(size[0] / 2, size[1] / 2, 0);
    for (int axis = 0; axis < 3; ++axis) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      for (int side = axis == 2 ? 1 : 0; side < 2; ++side) {
        for (auto count = static_cast<int>(size[a] * size[b] * per_area); count > 0; --count) {
          Vector p = low;
          p[axis] += side * size[axis] + noise();
          p[a] += uniform(0, size[a]);
          p[b] += uniform(0, size[b]);
          add(p, 1);
        }
      }
    }
  }
  void outliers(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) add(Vector(uniform(-0.6, 0.6), uniform(-0.4, 0.4), uniform(-0.1, 0.5)), 0);
  }
  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53; }

  PointsView points() const { return {std::span<const double>(rows_), 3}; }
  const std::vector<std::uint16_t>& truth() const { return truth_; }

 private:
  /// Nearly normal, the same with every standard library.
  double noise() {
    double sum = 0;
    for (int k = 0; k < 12; ++k) sum += uniform(-0.5, 0.5);
    return kNoise * sum;
  }
  void add(const Vector& p, std::uint16_t label) {
    rows_.insert(rows_.end(), p.begin(), p.end());
    truth_.push_back(label);
  }

  std::mt19937_64 engine_;
  std::vector<double> rows_;
  std::vector<std::uint16_t> truth_;
};

Scene table_scene(std::uint64_t seed) {
  Scene scene(seed);
  scene.table(9000);
  scene.cylinder(Vector(-0.3, 0.15, 0.01), kRadius[0], 0.2, 2500, 2);
  scene.cylinder(Vector(0.3, 0.2, 0.01), kRadius[1], 0.15, 3000, 3);
  scene.sphere(Vector(-0.1, -0.2, 0.07), kRadius[2], 2000, 4);
  scene.sphere(Vector(0.25, -0.15, 0.1), kRadius[3], 3500, 5);
  scene.outliers(2000);
  return scene;
}

FitOptions options_for(std::vector<ModelType> kinds, std::uint64_t seed = 1) {
  FitOptions options;
  options.model = kinds.front();
  options.rivals.assign(kinds.begin() + 1, kinds.end());
  options.backend = "cpu";
  options.seed = seed;
  return options;
}

const std::vector<ModelType> kAll{ModelType::plane, ModelType::cylinder, ModelType::sphere};

double radius(const Model& model) { return model.parameters[model.parameters.size() - 1]; }

std::string told(const FitResult& result) {
  std::string all;
  for (const Model& m : result.models)
    all += std::string(name(m.type)) + " " + std::to_string(radius(m)) + " " + std::to_string(m.inliers) + "; ";
  return all;
}

std::vector<double> radii(const FitResult& result, ModelType type) {
  std::vector<double> found;
  for (const Model& model : result.models) {
    if (model.type == type) found.push_back(radius(model));
  }
  std::sort(found.begin(), found.end());
  return found;
}

void expect_radii(const FitResult& result, ModelType type, std::span<const double> truth) {
  const auto found = radii(result, type);
  ASSERT_EQ(found.size(), truth.size()) << told(result);
  for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(found[k], truth[k], 0.05 * truth[k]) << told(result);
}

/// What is found may be wrong about things of a kind that was not asked for, but it is not made of the table.
void expect_not_the_table(const Scene& scene, const FitResult& result) {
  std::vector<std::size_t> table(result.models.size() + 1, 0);
  for (std::size_t i = 0; i < scene.truth().size(); ++i) table[result.labels[i]] += scene.truth()[i] == 1 ? 1U : 0U;
  for (std::size_t m = 0; m < result.models.size(); ++m) {
    EXPECT_LT(2 * table[m + 1], result.models[m].inliers) << "model " << m << " of " << told(result);
  }
}

class FitMixed : public testing::TestWithParam<int> {};

TEST_P(FitMixed, EachThingIsFoundAsWhatItIs) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const Scene scene = table_scene(seed);
  const auto result = fit(scene.points(), options_for(kAll, seed));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(radii(*result, ModelType::plane).size(), 1U) << told(*result);
  expect_radii(*result, ModelType::cylinder, std::span(kRadius).first(2));
  expect_radii(*result, ModelType::sphere, std::span(kRadius).last(2));
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < scene.truth().size(); ++i) {
    const std::uint16_t label = result->labels[i], truth = scene.truth()[i];
    if (truth == 0) continue;
    const ModelType type = truth == 1 ? ModelType::plane : truth < 4 ? ModelType::cylinder : ModelType::sphere;
    if (label == 0 || result->models[label - 1U].type != type) ++wrong;
  }
  EXPECT_LT(wrong, scene.truth().size() / 20);
  for (const Model& model : result->models) {
    EXPECT_TRUE(model.covariance.allFinite());
    EXPECT_EQ(model.covariance.rows(), model.parameters.size());
    EXPECT_GT(model.inliers, 0U);
  }
}

TEST_P(FitMixed, OrderOfKindsIsNoMatter) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const Scene scene = table_scene(seed + 100);
  const auto result = fit(scene.points(), options_for({ModelType::sphere, ModelType::plane, ModelType::cylinder}, seed));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(radii(*result, ModelType::plane).size(), 1U) << told(*result);
  expect_radii(*result, ModelType::cylinder, std::span(kRadius).first(2));
  expect_radii(*result, ModelType::sphere, std::span(kRadius).last(2));
}

TEST_P(FitMixed, WhatIsAskedForAloneIsNotFoundInTheTable) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const Scene scene = table_scene(seed + 200);
  const auto spheres = fit(scene.points(), options_for({ModelType::sphere}, seed));
  ASSERT_TRUE(spheres) << spheres.error().message;
  for (const double r : {kRadius[2], kRadius[3]}) {
    const auto found = radii(*spheres, ModelType::sphere);
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](double f) { return std::abs(f - r) < 0.05 * r; })) << told(*spheres);
  }
  expect_not_the_table(scene, *spheres);
  const auto cylinders = fit(scene.points(), options_for({ModelType::cylinder}, seed));
  ASSERT_TRUE(cylinders) << cylinders.error().message;
  for (const double r : {kRadius[0], kRadius[1]}) {
    const auto found = radii(*cylinders, ModelType::cylinder);
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](double f) { return std::abs(f - r) < 0.05 * r; })) << told(*cylinders);
  }
  expect_not_the_table(scene, *cylinders);
}

TEST_P(FitMixed, PlanesAloneGiveNothingCurved) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 300);
  scene.table(6000);
  scene.outliers(1500);
  for (const std::vector<ModelType>& kinds : {std::vector{ModelType::cylinder}, std::vector{ModelType::sphere}, kAll}) {
    const auto result = fit(scene.points(), options_for(kinds, seed));
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->models.size(), kinds.size() > 1 ? 1U : 0U) << told(*result);
    for (const Model& model : result->models) EXPECT_EQ(model.type, ModelType::plane) << told(*result);
  }
}

TEST_P(FitMixed, FacesThatASphereCrossesAreNotOne) {
  // A wide sphere within tau of five or ten faces has many points, and no two planes have as many.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 400);
  scene.table(4000);
  const auto length = [&] { return scene.uniform(0.05, 0.25); };
  for (int k = 0; k < 10; ++k) {
    scene.box({scene.uniform(-0.5, 0.5), scene.uniform(-0.3, 0.3), scene.uniform(0, 0.2)}, {length(), length(), length()}, 5000);
  }
  scene.outliers(1000);
  const auto result = fit(scene.points(), options_for({ModelType::sphere}, seed));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_TRUE(result->models.empty()) << told(*result);
}

TEST_P(FitMixed, ClutterGivesNothingCurvedBesidePlanes) {
  // What planes leave of many boxes lies within tau of something round.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 500);
  const auto length = [&] { return scene.uniform(0.05, 0.25); };
  for (int k = 0; k < 14; ++k) {
    scene.box({scene.uniform(-0.5, 0.5), scene.uniform(-0.3, 0.3), scene.uniform(0, 0.2)}, {length(), length(), length()}, 2000);
  }
  scene.outliers(500);
  for (const std::vector<ModelType>& kinds : {std::vector{ModelType::cylinder}, kAll}) {
    const auto result = fit(scene.points(), options_for(kinds, seed));
    ASSERT_TRUE(result) << result.error().message;
    for (const Model& model : result->models) EXPECT_EQ(model.type, ModelType::plane) << told(*result);
  }
}

TEST_P(FitMixed, WhatIsRoundInAnotherWayIsNotPiecedTogether) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene balls(seed + 600), tubes(seed + 700);
  for (Scene* scene : {&balls, &tubes}) scene->table(5000);
  balls.sphere(Vector(-0.2, 0.1, 0.15), 0.15, 3000, 2);
  balls.sphere(Vector(0.3, -0.1, 0.09), 0.09, 1500, 3);
  tubes.cylinder(Vector(-0.2, 0.1, 0.01), 0.1, 0.3, 3000, 2);
  tubes.cylinder(Vector(0.3, -0.1, 0.01), 0.05, 0.2, 1500, 3);
  for (Scene* scene : {&balls, &tubes}) scene->outliers(500);
  const auto cylinders = fit(balls.points(), options_for({ModelType::cylinder}, seed));
  ASSERT_TRUE(cylinders) << cylinders.error().message;
  EXPECT_TRUE(cylinders->models.empty()) << told(*cylinders);
  const auto spheres = fit(tubes.points(), options_for({ModelType::sphere}, seed));
  ASSERT_TRUE(spheres) << spheres.error().message;
  EXPECT_TRUE(spheres->models.empty()) << told(*spheres);
}

TEST_P(FitMixed, WhatTheHiddenTableExplainsIsNobodys) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  for (const bool few : {false, true}) {
    Scene scene(seed + 800);
    scene.table(few ? 1500 : 9000);
    scene.sphere(Vector(0.1, 0.05, 0.05), 0.05, few ? 300 : 1200, 2);
    const auto result = fit(scene.points(), options_for({ModelType::sphere}, seed));
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), 1U) << told(*result);
    std::size_t of_table = 0, labelled = 0;
    for (std::size_t i = 0; i < scene.truth().size(); ++i) {
      if (result->labels[i] == 0) continue;
      ASSERT_EQ(result->labels[i], 1);
      ++labelled;
      of_table += scene.truth()[i] == 1 ? 1U : 0U;
    }
    EXPECT_EQ(labelled, result->models[0].inliers);
    EXPECT_LT(40 * of_table, labelled) << told(*result);
  }
}

TEST_P(FitMixed, ABallThatAPlaneCutsIsStillPaidFor) {
  // It has a little over one point in a hundred, and a board goes on through it.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 900);
  scene.table(8200);
  scene.box({-0.3, 0.1, 0}, {0.3, 0.3, 0.012}, 8000);
  scene.sphere(Vector(0.2, -0.1, 0.05), 0.05, 118, 2);
  const auto result = fit(scene.points(), options_for(kAll, seed));
  ASSERT_TRUE(result) << result.error().message;
  expect_radii(*result, ModelType::sphere, std::array{0.05});
}

TEST_P(FitMixed, AnOutlineDoesNotWidenWhatItSurrounds) {
  // Where a camera mixes a cylinder with what is behind it, points trail off from its edges, within tau of it and outside.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 1000);
  scene.table(9000);
  scene.half_cylinder(Vector(0, 0, 0.01), 0.04, 0.2, 2000, 800, 2);
  const auto result = fit(scene.points(), options_for({ModelType::cylinder}, seed));
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 1U) << told(*result);
  EXPECT_NEAR(radius(result->models[0]), 0.04, 0.06 * 0.04) << told(*result);
}

TEST_P(FitMixed, ThePlaneThatStandsOutIsToldFirst) {
  // The barrel has more points, and would be found first.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 1100);
  scene.table(5000);
  scene.cylinder(Vector(0, 0, 0.01), 0.2, 0.5, 9000, 2);
  std::vector<ModelType> told_of;
  const auto result =
      fit(scene.points(), options_for({ModelType::cylinder, ModelType::sphere, ModelType::plane}, seed), [&](const Model& model) {
        told_of.push_back(model.type);
        return told_of.size() == 1 ? Verdict::stop : Verdict::go_on;
      });
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(told_of, std::vector{ModelType::plane});
  ASSERT_EQ(result->models.size(), 1U);
  EXPECT_GT(std::abs(result->models[0].normal().z()), 0.999);
  EXPECT_NEAR(result->models[0].offset(), 0, 0.002);
}

TEST_P(FitMixed, WhatIsBentIsNoPlaneThatStandsOut) {
  // A third of the barrel lies within tau of one plane, which is more than any plane there holds.
  const auto seed = static_cast<std::uint64_t>(GetParam());
  Scene scene(seed + 1200);
  scene.half_cylinder(Vector(0, 0, 0), 0.15, 0.5, 12000, 0, 2);
  scene.outliers(500);
  const auto result = fit(scene.points(), options_for({ModelType::plane, ModelType::cylinder}, seed));
  ASSERT_TRUE(result) << result.error().message;
  expect_radii(*result, ModelType::cylinder, std::array{0.15});
  EXPECT_TRUE(radii(*result, ModelType::plane).empty()) << told(*result);
}

INSTANTIATE_TEST_SUITE_P(Seeds, FitMixed, testing::Range(1, 6));

TEST(FitMixedOnce, SameAnswerOnOneThreadAndTwo) {
  const Scene scene = table_scene(7);
  FitOptions options = options_for(kAll, 3);
  options.threads = 1;
  const auto one = fit(scene.points(), options);
  options.threads = 2;
  const auto two = fit(scene.points(), options), again = fit(scene.points(), options);
  ASSERT_TRUE(one && two && again);
  tests::expect_same_answer(*one, *two);
  tests::expect_same_answer(*again, *two);
}

TEST(FitMixedOnce, FewThinBoxesAreTakenForCylinders) {
  // Each lies within tau of one, on all sides: by its points' distances alone the cylinder is a good one.
  constexpr double kSide = 0.055;
  std::size_t taken = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Scene scene(seed + 1100);
    scene.table(6000);
    for (const double x : {-0.3, 0.2}) scene.box({x, scene.uniform(-0.2, 0.2), 0}, {kSide, kSide, 0.2}, 15000);
    const auto result = fit(scene.points(), options_for({ModelType::cylinder}, seed));
    ASSERT_TRUE(result) << result.error().message;
    taken += result->models.size();
  }
  EXPECT_LE(taken, 3U) << "of 10";
}

TEST(FitMixedOnce, WhatIsRefusedHidesLittle) {
  // Much is refused that runs across boxes and what stands beside them. Each of these cylinders has a little over one point in a hundred.
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Scene scene(seed + 1200);
    scene.table(9000);
    for (int k = 0; k < 6; ++k) {
      const double x = -0.45 + 0.18 * k, y = k % 2 == 0 ? -0.2 : 0.2;
      scene.box({x, y, 0}, {0.12, 0.12, 0.15}, 9000);
      scene.cylinder({x, 0.5 * y, 0.01}, 0.03, 0.12, 260, static_cast<std::uint16_t>(2 + k));
    }
    scene.outliers(3000);
    const auto result = fit(scene.points(), options_for({ModelType::cylinder}, seed));
    ASSERT_TRUE(result) << result.error().message;
    for (const Model& model : result->models) found += std::abs(radius(model) - 0.03) < 0.05 * 0.03 ? 1U : 0U;
  }
  EXPECT_GE(found, 24U) << "of 72";
}

TEST(FitMixedOnce, LinesAndCircles) {
  std::mt19937_64 engine(3);
  const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53; };
  std::vector<double> rows;
  const auto near = [&](double x, double y) { rows.insert(rows.end(), {x + uniform(-0.004, 0.004), y + uniform(-0.004, 0.004)}); };
  for (int i = 0; i < 200; ++i) {
    const double t = uniform(-1, 1), turn = uniform(0, 2 * std::numbers::pi);
    near(t, 0.3 * t - 0.5);
    near(-0.3 + 0.4 * std::cos(turn), 0.3 + 0.4 * std::sin(turn));
    rows.insert(rows.end(), {uniform(-1, 1), uniform(-1, 1)});
  }
  FitOptions options = options_for({ModelType::line2d, ModelType::circle2d});
  for (const bool estimated : {false, true}) {
    options.threshold = estimated ? std::nullopt : std::optional(0.01);
    const auto result = fit(PointsView(std::span<const double>(rows), 2), options);
    ASSERT_TRUE(result) << result.error().message;
    ASSERT_EQ(result->models.size(), 2U) << told(*result);
    EXPECT_NE(result->models[0].type, result->models[1].type) << told(*result);
    const auto circles = radii(*result, ModelType::circle2d);
    ASSERT_EQ(circles.size(), 1U);
    EXPECT_NEAR(circles[0], 0.4, 0.02);
  }
}

TEST(FitMixedOnce, CoplanarPointsStillGiveAPlane) {
  std::vector<double> rows;
  for (int i = 0; i < 400; ++i) rows.insert(rows.end(), {(i % 20) * 0.05, (i / 20) * 0.05, 0.0});
  const auto result = fit(PointsView(std::span<const double>(rows), 3), options_for(kAll));
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 1U) << told(*result);
  EXPECT_EQ(result->models[0].type, ModelType::plane);
}

TEST(FitMixedOnce, WarmStartGoesToItsOwnKind) {
  const Scene scene = table_scene(11);
  auto fitter = Fitter::create(options_for(kAll));
  ASSERT_TRUE(fitter);
  const auto first = fitter->fit(scene.points());
  ASSERT_TRUE(first);
  const auto second = fitter->fit(scene.points(), {}, {}, first->models);
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->models.size(), first->models.size()) << told(*second);
}

TEST(FitMixedOnce, OptionsThatCannotBeAreNamed) {
  const auto refused = [](const FitOptions& options, std::initializer_list<const char*> words) {
    const auto ok = options.validate();
    ASSERT_FALSE(ok);
    EXPECT_EQ(ok.error().kind, Error::Kind::invalid_option);
    for (const char* word : words) EXPECT_NE(ok.error().message.find(word), std::string::npos) << ok.error().message;
  };
  refused(options_for({ModelType::plane, ModelType::line2d}), {"rivals", "line2d", "3", "2"});
  refused(options_for({ModelType::plane, ModelType::sphere, ModelType::sphere}), {"rivals", "sphere", "once"});
  refused(options_for({ModelType::plane, ModelType::plane}), {"rivals", "plane", "once"});
  refused(options_for({ModelType::homography, ModelType::fundamental}), {"rivals", "fundamental"});
  FitOptions paper = options_for(kAll);
  paper.preset = Preset::paper;
  refused(paper, {"deflation", "parametric", "residual"});
  EXPECT_EQ(model_types("plane,sphere")->size(), 2U);
  EXPECT_FALSE(model_types("plane,"));
  EXPECT_FALSE(model_types("plane,blob"));
}

}  // namespace
}  // namespace swarmfit
