// Each kind's residual against the formula in a textbook, and what it must say where that formula has no answer.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/evaluators.hpp"

namespace swarmfit::kernels {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
using Point = std::array<double, 4>;
using Vector = std::array<double, 3>;

Vector times(const double* m, const Vector& x) {
  Vector y{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) y[r] += m[3 * r + c] * x[c];
  }
  return y;
}

double transfer(const double* h, double x, double y, double to_x, double to_y) {
  const Vector at = times(h, {x, y, 1});
  return std::hypot(at[0] / at[2] - to_x, at[1] / at[2] - to_y);
}

std::array<double, 9> inverse(const double* a) {
  const std::array<double, 9> adjugate{a[4] * a[8] - a[5] * a[7], a[2] * a[7] - a[1] * a[8], a[1] * a[5] - a[2] * a[4],
                                       a[5] * a[6] - a[3] * a[8], a[0] * a[8] - a[2] * a[6], a[2] * a[3] - a[0] * a[5],
                                       a[3] * a[7] - a[4] * a[6], a[1] * a[6] - a[0] * a[7], a[0] * a[4] - a[1] * a[3]};
  const double determinant = a[0] * adjugate[0] + a[1] * adjugate[3] + a[2] * adjugate[6];
  std::array<double, 9> out{};
  for (std::size_t i = 0; i < 9; ++i) out[i] = adjugate[i] / determinant;
  return out;
}

double textbook(ModelKind kind, const double* p, const Point& x) {
  switch (kind) {
    case ModelKind::line2d: return std::abs(p[0] * x[0] + p[1] * x[1] + p[2]);
    case ModelKind::plane: return std::abs(p[0] * x[0] + p[1] * x[1] + p[2] * x[2] + p[3]);
    case ModelKind::circle2d: return std::abs(std::hypot(x[0] - p[0], x[1] - p[1]) - p[2]);
    case ModelKind::sphere: return std::abs(std::hypot(x[0] - p[0], x[1] - p[1], x[2] - p[2]) - p[3]);
    case ModelKind::cylinder: {
      const double x0 = x[0] - p[0], x1 = x[1] - p[1], x2 = x[2] - p[2];
      return std::abs(std::hypot(x1 * p[5] - x2 * p[4], x2 * p[3] - x0 * p[5], x0 * p[4] - x1 * p[3]) - p[6]);
    }
    case ModelKind::homography: {
      const double there = transfer(p, x[0], x[1], x[2], x[3]), back = transfer(inverse(p).data(), x[2], x[3], x[0], x[1]);
      return std::sqrt((there * there + back * back) / 2);
    }
    case ModelKind::own:
    case ModelKind::fundamental: break;
  }
  const std::array<double, 9> transposed{p[0], p[3], p[6], p[1], p[4], p[7], p[2], p[5], p[8]};
  const Vector there = times(p, {x[0], x[1], 1}), back = times(transposed.data(), {x[2], x[3], 1});
  return std::abs(x[2] * there[0] + x[3] * there[1] + there[2]) /
         std::sqrt(std::pow(std::hypot(there[0], there[1]), 2) + std::pow(std::hypot(back[0], back[1]), 2));
}

/// A model that passes through or near the cube (or image pair) of half width 1 about `middle`.
std::vector<double> random_model(ModelKind kind, double middle, const std::function<double(double, double)>& uniform) {
  std::vector<double> p(static_cast<std::size_t>(traits(kind).parameter_count));
  for (double& v : p) v = uniform(-1, 1);
  const auto normalise = [&](std::size_t first, std::size_t count) {
    double square = 0;
    for (std::size_t i = first; i < first + count; ++i) square += p[i] * p[i];
    for (std::size_t i = first; i < first + count; ++i) p[i] /= std::sqrt(square);
  };
  if (kind == ModelKind::line2d || kind == ModelKind::plane) {
    normalise(0, p.size() - 1);
    for (std::size_t i = 0; i + 1 < p.size(); ++i) p.back() -= p[i] * middle;
  } else if (kind == ModelKind::circle2d || kind == ModelKind::sphere) {
    for (std::size_t i = 0; i + 1 < p.size(); ++i) p[i] += middle;
    p.back() = uniform(0.1, 2);
  } else if (kind == ModelKind::cylinder) {
    normalise(3, 3);
    for (std::size_t i = 0; i < 3; ++i) p[i] += middle;
    p.back() = uniform(0.1, 2);
  } else if (kind == ModelKind::homography) {
    for (std::size_t i = 0; i < 9; ++i) p[i] = (i % 4 == 0 ? 1 : 0) + (i >= 6 && i < 8 ? 0.1 : 0.3) * p[i];
  }
  return p;
}

std::vector<Point> random_points(std::size_t count, double middle, const std::function<double(double, double)>& uniform) {
  std::vector<Point> points(count);
  for (Point& point : points) {
    for (double& v : point) v = middle + uniform(-1, 1);
  }
  return points;
}

std::vector<float> distances(FitnessEvaluator& evaluator, ModelKind kind, const std::vector<double>& model,
                             const std::vector<Point>& points) {
  EXPECT_TRUE(evaluator.set_points({points.data(), Scalar::float64, traits(kind).dimension, points.size(), sizeof(Point)}));
  std::vector<float> found(points.size());
  const auto done = evaluator.distances({kind, model}, found);
  EXPECT_TRUE(done) << done.error().message;
  return found;
}

class Models : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    auto made = GetParam() == "cpu" ? make_cpu_evaluator({}) : make_reference_evaluator();
    ASSERT_TRUE(made) << made.error().message;
    evaluator_ = std::move(*made);
  }
  FitnessEvaluator& evaluator() { return *evaluator_; }
  /// Largest error of a distance relative to the size of what is compared.
  double tolerance() const { return GetParam() == "cpu" ? 3e-6 : 1e-7; }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  std::function<double(double, double)> numbers() {
    return [this](double low, double high) { return uniform(low, high); };
  }

 private:
  std::unique_ptr<FitnessEvaluator> evaluator_;
  std::mt19937 engine_{7};
};
INSTANTIATE_TEST_SUITE_P(Backends, Models, testing::Values("reference", "cpu"), [](const auto& backend) { return backend.param; });

TEST_P(Models, ResidualsAreThoseOfTheTextbook) {
  for (const ModelKind kind : kModelKinds) {
    for (int round = 0; round < 40; ++round) {
      SCOPED_TRACE(std::string(traits(kind).name) + ", round " + std::to_string(round));
      const double middle = round % 2 == 0 ? 0 : 4;
      const std::vector<double> model = random_model(kind, middle, numbers());
      const std::vector<Point> points = random_points(300, middle, numbers());
      const std::vector<float> found = distances(evaluator(), kind, model, points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double expected = textbook(kind, model.data(), points[i]);
        // Close to where a point maps to infinity, the formula magnifies its own rounding.
        if (expected > 10) continue;
        EXPECT_NEAR(static_cast<double>(found[i]), expected, tolerance() * 30 * std::max(1.0, expected * expected)) << i;
      }
    }
  }
}

TEST_P(Models, AFlatSphereIsAPlane) {
  for (const double radius : {1e2, 1e4, 1e7, 1e12}) {
    const std::vector<Point> points = random_points(500, 0, numbers());
    const Vector normal{2.0 / 7, 3.0 / 7, 6.0 / 7};
    std::vector<double> sphere, cylinder, circle{0.6 * radius, 0.8 * radius, radius};
    for (const double n : normal) sphere.push_back(n * radius);
    cylinder = sphere;
    cylinder.insert(cylinder.end(), {6.0 / 7, 2.0 / 7, -3.0 / 7, radius});
    sphere.push_back(radius);
    // By how much a surface of that radius bends away over the cloud, and what doubles hold of its centre.
    const double allowed = tolerance() + 4 / radius + 1e-15 * radius;
    const std::vector<float> round = distances(evaluator(), ModelKind::sphere, sphere, points);
    const std::vector<float> tube = distances(evaluator(), ModelKind::cylinder, cylinder, points);
    const std::vector<float> arc = distances(evaluator(), ModelKind::circle2d, circle, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double plane = std::abs(normal[0] * points[i][0] + normal[1] * points[i][1] + normal[2] * points[i][2]);
      EXPECT_NEAR(static_cast<double>(round[i]), plane, allowed) << radius;
      EXPECT_NEAR(static_cast<double>(tube[i]), plane, allowed) << radius;
      EXPECT_NEAR(static_cast<double>(arc[i]), std::abs(0.6 * points[i][0] + 0.8 * points[i][1]), allowed) << radius;
    }
  }
}

TEST_P(Models, SmallOnesAreExactFarFromTheMiddle) {
  std::vector<Point> points = random_points(400, 100, numbers());
  points[0] = {-100, -100, -100, 0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    for (double& v : points[i]) v = 100 + (v - 100) * 0.01;
  }
  for (const ModelKind kind : {ModelKind::circle2d, ModelKind::sphere, ModelKind::cylinder}) {
    std::vector<double> model(kind == ModelKind::circle2d ? 2 : 3, 100);
    if (kind == ModelKind::cylinder) model.insert(model.end(), {0, 0.6, 0.8});
    model.push_back(0.005);
    const std::vector<float> found = distances(evaluator(), kind, model, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double expected = textbook(kind, model.data(), points[i]);
      EXPECT_NEAR(static_cast<double>(found[i]), expected, 10 * tolerance() * std::max(1.0, expected)) << traits(kind).name;
    }
  }
}

TEST_P(Models, ARadiusOfZeroIsAPointOrALine) {
  const std::vector<Point> points{{1, 2, 3, 0}, {1, 2, 4, 0}, {-1, -2, -3, 0}, {-1, -2, -4, 0}};
  const std::vector<float> sphere = distances(evaluator(), ModelKind::sphere, {1, 2, 3, 0}, points);
  EXPECT_EQ(sphere[0], 0.0F);
  EXPECT_FLOAT_EQ(sphere[1], 1.0F);
  const std::vector<float> circle = distances(evaluator(), ModelKind::circle2d, {1, 2, 0}, points);
  EXPECT_EQ(circle[0], 0.0F);
  EXPECT_FLOAT_EQ(circle[2], std::sqrt(20.0F));
  const std::vector<float> cylinder = distances(evaluator(), ModelKind::cylinder, {1, 2, 7, 0, 0, 1, 0}, points);
  EXPECT_NEAR(cylinder[0], 0, 1e-6);
  EXPECT_NEAR(cylinder[1], 0, 1e-6);
  EXPECT_FLOAT_EQ(cylinder[2], std::sqrt(20.0F));
}

TEST(Balls, ACentreTooNearOrTooFarForSquaresKeepsItsDirection) {
  const std::array<double, 2> origin{};
  const double unit = std::sqrt(0.5);
  for (const double far : {1e-250, 1e-170, 1e-90, 1.0, 1e90, 1e170}) {
    const std::array<double, 3> circle{far, -far, 1};
    std::array<double, 7> k{};
    ASSERT_TRUE(centred_coefficients(ModelKind::circle2d, circle.data(), origin.data(), k.data())) << far;
    const double near = std::clamp(far / unit - 1, -1e15, 1e15);  // to the nearer end of the diameter through the origin
    EXPECT_NEAR(k[0] / near, unit, 1e-12) << far;
    EXPECT_NEAR(k[1] / near, -unit, 1e-12) << far;
  }
}

TEST_P(Models, NeitherScaleNorSignOfAMatrixMatters) {
  const std::vector<Point> points = random_points(200, 3, numbers());
  for (const ModelKind kind : {ModelKind::homography, ModelKind::fundamental}) {
    const std::vector<double> model = random_model(kind, 3, numbers());
    const std::vector<float> expected = distances(evaluator(), kind, model, points);
    for (const double factor : {-1.0, 1e-200, 1e200}) {
      std::vector<double> other = model;
      for (double& v : other) v *= factor;
      const std::vector<float> found = distances(evaluator(), kind, other, points);
      for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-5F * std::max(1.0F, expected[i])) << factor;
    }
  }
}

TEST_P(Models, WhatHasNoImageCostsItsCap) {
  // x1 = 0 maps to infinity; in the centred frame as well, and exactly.
  const std::vector<double> to_infinity{0, 0, 1, 0, 1, 0, 1, 0, 0};
  const std::vector<Point> points{{0, 0, 5, 5}, {0, 1, 2, 3}, {-4, -1, -7, -8}, {4, 0, 0, 0}};
  const std::vector<float> found = distances(evaluator(), ModelKind::homography, to_infinity, points);
  EXPECT_EQ(found[0], kInf);
  EXPECT_EQ(found[1], kInf);

  const std::vector<std::vector<double>> singular{
      {0, 0, 0, 0, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 0}, {1, 2, 3, 2, 4, 6, 0, 0, 1}, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}};
  const std::vector<float> caps{1, 0.5F, 0, 2};
  for (const std::vector<double>& matrix : singular) {
    for (const float distance : distances(evaluator(), ModelKind::homography, matrix, points)) EXPECT_EQ(distance, kInf);
    ASSERT_TRUE(evaluator().set_caps(caps));
    float cost = 0;
    ASSERT_TRUE(evaluator().evaluate({ModelKind::homography, 1, matrix}, Loss::truncated_l1, {}, {&cost, 1}));
    EXPECT_FLOAT_EQ(cost, 3.5F);
    ASSERT_TRUE(evaluator().evaluate({ModelKind::homography, 1, matrix}, Loss::truncated_l2, {}, {&cost, 1}));
    EXPECT_FLOAT_EQ(cost, 5.25F);
  }
  const std::vector<double> nothing(9, 0.0);
  for (const float distance : distances(evaluator(), ModelKind::fundamental, nothing, points)) EXPECT_EQ(distance, kInf);
  // Both points are the epipoles of a rotation about the axis between them: 0 / 0.
  const std::vector<double> both{0, -1, 0, 1, 0, 0, 0, 0, 0};
  const std::vector<Point> epipoles{{0, 0, 0, 0}, {1, 1, 1, 1}, {-1, -1, -1, -1}};
  const std::vector<float> at = distances(evaluator(), ModelKind::fundamental, both, epipoles);
  EXPECT_EQ(at[0], kInf);
  EXPECT_LT(at[1], 1e-6F);
}

TEST_P(Models, WhatIsNoModelCostsInfinity) {
  const std::vector<Point> points = random_points(20, 0, numbers());
  for (const ModelKind kind : kModelKinds) {
    const std::vector<double> model = random_model(kind, 0, numbers());
    for (std::size_t i = 0; i < model.size(); ++i) {
      for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
        std::vector<double> broken = model;
        broken[i] = bad;
        for (const float distance : distances(evaluator(), kind, broken, points)) EXPECT_EQ(distance, kInf) << traits(kind).name << i;
        float cost = 0;
        ASSERT_TRUE(evaluator().evaluate({kind, 1, broken}, Loss::truncated_l1, {}, {&cost, 1}));
        EXPECT_EQ(cost, kInf) << traits(kind).name << i;
      }
    }
  }
  for (const float distance : distances(evaluator(), ModelKind::cylinder, {0, 0, 0, 0, 0, 0, 1}, points)) EXPECT_EQ(distance, kInf);
}

}  // namespace
}  // namespace swarmfit::kernels
