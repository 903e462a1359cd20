// Every kind of model: minimal samples, moves, refinement and the truth of its covariance.
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <numeric>
#include <ostream>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "host/models/model_space.hpp"

namespace swarmfit::models {
namespace {

using Engine = std::mt19937_64;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

double uniform(Engine& engine, double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }

struct Kind {
  ModelType type;
  Eigen::VectorXd truth;                                          // in the data's frame, as ModelType has it
  std::function<Eigen::VectorXd(Engine&)> point;                  // on the model, without noise
  std::function<Eigen::VectorXd(const Eigen::VectorXd&)> normal;  // of a point, where the kind asks for it
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << name(kind.type); }

Eigen::VectorXd values(std::initializer_list<double> list) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(list.size()));
  std::copy(list.begin(), list.end(), v.begin());
  return v;
}

Kind line2d() {
  const Eigen::Vector2d n(0.6, 0.8), foot = -3.0 * n;
  return {ModelType::line2d,
          values({0.6, 0.8, 3.0}),
          [=](Engine& e) { return Eigen::VectorXd(foot + uniform(e, -4, 5) * Eigen::Vector2d(-0.8, 0.6)); },
          {}};
}

Kind plane() {
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, -2) / 3, u = n.unitOrthogonal(), v = n.cross(u);
  return {ModelType::plane,
          values({n[0], n[1], n[2], -1.5}),
          [=](Engine& e) { return Eigen::VectorXd(1.5 * n + uniform(e, -1, 3) * u + uniform(e, -2, 1) * v); },
          {}};
}

Kind circle2d() {
  return {ModelType::circle2d,
          values({10, -4, 2.5}),
          [](Engine& e) {
            const double a = uniform(e, 0, 4.5);
            return values({10 + 2.5 * std::cos(a), -4 + 2.5 * std::sin(a)});
          },
          {}};
}

Kind sphere() {
  return {ModelType::sphere,
          values({1, -2, 5, 0.75}),
          [](Engine& e) {
            const double z = uniform(e, -0.2, 1), a = uniform(e, 0, 6.28), r = std::sqrt(1 - z * z);
            return values({1 + 0.75 * r * std::cos(a), -2 + 0.75 * r * std::sin(a), 5 + 0.75 * z});
          },
          {}};
}

Kind cylinder() {
  const Eigen::Vector3d axis = Eigen::Vector3d(2, -1, 2) / 3, u = axis.unitOrthogonal(), v = axis.cross(u), through(0.3, 0.2, 4);
  return {ModelType::cylinder, values({0.3, 0.2, 4, axis[0], axis[1], axis[2], 0.4}),
          [=](Engine& e) {
            const double a = uniform(e, 0, 4.5);
            return Eigen::VectorXd(through + uniform(e, -0.8, 1.2) * axis + 0.4 * (std::cos(a) * u + std::sin(a) * v));
          },
          [=](const Eigen::VectorXd& p) {
            const Eigen::Vector3d arm = Eigen::Vector3d(p) - through;
            return Eigen::VectorXd((arm - arm.dot(axis) * axis).normalized());
          }};
}

Kind homography() {
  Matrix3 h;
  h << 1.1, 0.08, 12, -0.05, 0.95, 30, 1e-4, -2e-4, 1;
  h /= h.norm();
  return {ModelType::homography,
          h.reshaped<Eigen::RowMajor>(),
          [=](Engine& e) {
            const Eigen::Vector3d x(uniform(e, 50, 500), uniform(e, 80, 400), 1), y = h * x;
            return values({x[0], x[1], y[0] / y[2], y[1] / y[2]});
          },
          {}};
}

/// Two cameras that look at points in space.
Kind fundamental() {
  Matrix3 k, cross;
  k << 600, 0, 320, 0, 600, 240, 0, 0, 1;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.12, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(-0.05, Eigen::Vector3d::UnitX())).toRotationMatrix();
  const Eigen::Vector3d shift(-0.6, 0.1, 0.15);
  cross << 0, -shift[2], shift[1], shift[2], 0, -shift[0], -shift[1], shift[0], 0;
  Matrix3 f = k.inverse().transpose() * cross * turn * k.inverse();
  f /= f.norm();
  return {ModelType::fundamental,
          f.reshaped<Eigen::RowMajor>(),
          [=](Engine& e) {
            const Eigen::Vector3d p(uniform(e, -2, 2), uniform(e, -1.5, 1.5), uniform(e, 3, 8));
            const Eigen::Vector3d x = k * p, y = k * (turn * p + shift);
            return values({x[0] / x[2], x[1] / x[2], y[0] / y[2], y[1] / y[2]});
          },
          {}};
}

/// What a test needs of a cloud drawn from a kind.
struct Draw {
  Draw(const Kind& kind, std::size_t count, double noise, Engine& engine) {
    std::normal_distribution<double> normal;
    std::vector<Eigen::Vector3f> normals;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::VectorXd p = kind.point(engine);
      if (kind.normal) normals.emplace_back(kind.normal(p).cast<float>());
      for (const double v : p) rows.push_back(v + noise * normal(engine));
    }
    points = WorkingPoints(PointsView(std::span<const double>(rows), dimension(kind.type)));
    points.set_normals(std::move(normals));
    index.resize(count);
    std::iota(index.begin(), index.end(), 0U);
    weight.assign(count, 1.0);
  }
  Weighted all() const { return {index, weight}; }

  std::vector<double> rows;
  WorkingPoints points;
  std::vector<std::uint32_t> index;
  std::vector<double> weight;
};

/// The true position, with the sign that is nearest to theta's.
Position truth_near(const Kind& kind, const ModelSpace& space, const WorkingPoints& points, const Position& theta) {
  Position truth = space.from_data(kind.truth, points.frame());
  EXPECT_TRUE(space.admit(truth));
  Eigen::VectorXd way(space.parameter_count());
  space.difference(theta, truth, way);
  Position there = theta;
  space.move(there, way);
  return there;
}

class Models : public testing::TestWithParam<Kind> {
 protected:
  const std::unique_ptr<ModelSpace> space_ = make_space(GetParam().type, {});
  Engine engine_{7};
};

TEST_P(Models, AnExactMinimalSampleGivesTheModel) {
  int exact = 0, drawn = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Draw draw(GetParam(), 30, 0, engine_);
    Position theta;
    const auto wanted = static_cast<std::size_t>(space_->minimal_sample());
    if (!space_->from_sample(draw.points, std::span(draw.index).first(wanted), theta)) continue;
    ++drawn;
    exact += space_->distance(theta, truth_near(GetParam(), *space_, draw.points, theta)) < 1e-5;
  }
  EXPECT_GT(drawn, 100);
  // Seven points have up to three fundamental matrices, of which one is taken.
  EXPECT_GE(exact, GetParam().type == ModelType::fundamental ? drawn / 3 : drawn * 98 / 100);
}

TEST_P(Models, ADegenerateSampleGivesNone) {
  const Draw draw(GetParam(), 30, 0, engine_);
  Position theta;
  const std::array<std::uint32_t, 8> same{};
  EXPECT_FALSE(space_->from_sample(draw.points, std::span(same).first(static_cast<std::size_t>(space_->minimal_sample())), theta));
}

TEST_P(Models, AMoveByTheDifferenceArrives) {
  const Draw draw(GetParam(), 60, 0.01, engine_);
  const auto wanted = static_cast<std::size_t>(space_->minimal_sample());
  std::vector<Position> some;
  for (std::size_t at = 0; some.size() < 2 && at + wanted <= 60; ++at) {
    Position theta;
    if (space_->from_sample(draw.points, std::span(draw.index).subspan(at, wanted), theta)) some.push_back(theta);
  }
  ASSERT_EQ(some.size(), 2U);
  EXPECT_LT(space_->distance(some[0], some[0]), 1e-12);
  Eigen::VectorXd way(space_->parameter_count());
  space_->difference(some[0], some[1], way);
  Position there = some[0];
  space_->move(there, way);
  EXPECT_LT(space_->distance(there, some[1]), 1e-9);
}

TEST_P(Models, DataAndWorkingFrameAreInverse) {
  const Draw draw(GetParam(), 60, 0.01, engine_);
  Position theta = space_->from_data(GetParam().truth, draw.points.frame());
  ASSERT_TRUE(space_->admit(theta));
  const Position back = space_->from_data(space_->to_data(theta, draw.points.frame()), draw.points.frame());
  EXPECT_LT(space_->distance(theta, back), 1e-9);
}

TEST_P(Models, RefinementFindsTheTruthFromNearby) {
  const Draw draw(GetParam(), 200, 0, engine_);
  const Position truth = space_->from_data(GetParam().truth, draw.points.frame());
  for (int trial = 0; trial < 20; ++trial) {
    Position theta = truth;
    ASSERT_TRUE(space_->admit(theta));
    Eigen::VectorXd off(space_->parameter_count());
    for (double& v : off) v = uniform(engine_, -0.01, 0.01);
    space_->move(theta, off);
    ASSERT_TRUE(space_->admit(theta));
    for (int round = 0; round < 5; ++round) ASSERT_TRUE(space_->refine(draw.points, draw.all(), theta));
    EXPECT_LT(space_->distance(theta, truth_near(GetParam(), *space_, draw.points, theta)), 1e-6);
  }
}

TEST_P(Models, ManyPointsAreRefinedAsFewAre) {
  // The same points over and over: more than are kept from step to step.
  const Draw draw(GetParam(), 200, 0.01, engine_);
  constexpr std::size_t kTimes = 400;
  std::vector<std::uint32_t> index;
  for (std::size_t time = 0; time < kTimes; ++time) index.insert(index.end(), draw.index.begin(), draw.index.end());
  const std::vector<double> weight(index.size(), 1.0 / kTimes), once(draw.index.size(), 1.0);
  Position few = space_->from_data(GetParam().truth, draw.points.frame());
  ASSERT_TRUE(space_->admit(few));
  Position many = few;
  ASSERT_TRUE(space_->refine(draw.points, {draw.index, once}, few));
  ASSERT_TRUE(space_->refine(draw.points, {index, weight}, many));
  EXPECT_LT(space_->distance(few, many), 1e-6);
}

TEST_P(Models, TooFewPointsAreNotRefined) {
  const Draw draw(GetParam(), 60, 0, engine_);
  Position theta = space_->from_data(GetParam().truth, draw.points.frame());
  const Weighted one{std::span(draw.index).first(1), std::span(draw.weight).first(1)};
  EXPECT_FALSE(space_->refine(draw.points, one, theta));
}

/// Normalised estimation error squared: e^T C^+ e has the mean of a chi-squared variable of as many degrees as the model is free.
TEST_P(Models, CovarianceIsTrue) {
  // A few hundred tell a wrong factor; SWARMFIT_NEES_FITS=10000 tells a percent.
  const char* wanted = std::getenv("SWARMFIT_NEES_FITS");
  const int fits = wanted != nullptr ? std::atoi(wanted) : 600;
  const bool pixels = dimension(GetParam().type) == 4;
  const double noise = pixels ? 0.5 : 0.01;
  double sum = 0;
  for (int fit = 0; fit < fits; ++fit) {
    const Draw draw(GetParam(), 120, noise, engine_);
    const Frame& frame = draw.points.frame();
    Position theta = space_->from_data(GetParam().truth, frame);
    ASSERT_TRUE(space_->admit(theta));
    for (int round = 0; round < 3; ++round) ASSERT_TRUE(space_->refine(draw.points, draw.all(), theta));
    std::vector<double> squares(1, 0);
    for (std::uint32_t i : draw.index) {
      if (GetParam().type != ModelType::line2d && GetParam().type != ModelType::plane) break;  // the others know their own
      double d = theta[theta.size() - 1];
      for (int c = 0; c < dimension(GetParam().type); ++c) d += theta[c] * draw.points.at(i, c);
      squares[0] += d * d;
    }
    const double variance = space_->noise_variance(draw.points, draw.all(), theta, squares[0]);
    const Eigen::MatrixXd covariance =
        space_->covariance_to_data(variance * space_->unit_covariance(draw.points, draw.all(), theta), theta, frame);
    const Eigen::VectorXd error =
        space_->to_data(theta, frame) - space_->to_data(truth_near(GetParam(), *space_, draw.points, theta), frame);
    // In units of each parameter's own deviation, so that no unit decides what counts as 0.
    const Eigen::VectorXd unit = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = unit.asDiagonal() * covariance * unit.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
    const Eigen::VectorXd along = solver.eigenvectors().transpose() * unit.asDiagonal() * error;
    for (int k = 0; k < space_->freedom(); ++k) {
      const Eigen::Index at = solver.eigenvalues().size() - 1 - k;
      sum += along[at] * along[at] / solver.eigenvalues()[at];
    }
  }
  // The variance is estimated as well: what would be chi-squared is F times its degrees of freedom.
  const double freedom = space_->freedom(), residuals = 120.0 * (GetParam().type == ModelType::homography ? 2 : 1) - freedom;
  const double expected = freedom * residuals / (residuals - 2);
  const double deviation =
      std::sqrt(2 * freedom * (residuals + freedom - 2) / (residuals - 4)) * residuals / (residuals - 2) / std::sqrt(fits);
  const double mean = sum / fits;
  RecordProperty("nees", std::to_string(mean));
  if (wanted != nullptr) std::cout << "nees " << mean << " of " << expected << " +- " << deviation << '\n';
  EXPECT_NEAR(mean, expected, 3.3 * deviation + 0.005 * freedom);  // 99.9 %, and curvature
}

INSTANTIATE_TEST_SUITE_P(Kinds, Models, testing::Values(line2d(), plane(), circle2d(), sphere(), cylinder(), homography(), fundamental()),
                         [](const auto& kind) { return std::string(name(kind.param.type)); });

}  // namespace
}  // namespace swarmfit::models
