// A model that the library does not know: an ellipse, given at run time by its residual and a minimal solver, on every back end there is.
#include <swarmfit/swarmfit.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include <Eigen/Dense>

namespace {

using Doubles = std::span<const double>;

// Parameters: a centre (cx, cy), the half axes a >= b, and the angle of the longer one [rad] in [0, pi).
constexpr int kParameters = 5;

// The distance to first order: the implicit function over the length of its gradient.
double residual(Doubles x, Doubles p) {
  const double c = std::cos(p[4]), s = std::sin(p[4]);
  const double u = (c * (x[0] - p[0]) + s * (x[1] - p[1])) / p[2], v = (c * (x[1] - p[1]) - s * (x[0] - p[0])) / p[3];
  const double length = std::hypot(u / p[2], v / p[3]);
  return (u * u + v * v - 1) / (2 * length);  // no number at the very centre, and that counts as far
}

// The same for graphics cards, compiled when the fitter is made.
const char* const kGlsl = R"(
float residual(vec2 x, float p[5]) {
  const float c = cos(p[4]), s = sin(p[4]);
  const vec2 d = x - vec2(p[0], p[1]);
  const vec2 w = vec2(c * d.x + s * d.y, c * d.y - s * d.x) / vec2(p[2], p[3]);
  return (dot(w, w) - 1.0) / (2.0 * length(w / vec2(p[2], p[3])));
}
)";

// One form for all that mean the same ellipse; false where it is none.
bool normalise(std::span<double> p) {
  p[2] = std::abs(p[2]);
  p[3] = std::abs(p[3]);
  if (p[2] < p[3]) {
    std::swap(p[2], p[3]);
    p[4] += std::numbers::pi / 2;
  }
  p[4] -= std::numbers::pi * std::floor(p[4] / std::numbers::pi);
  return p[3] > 0 && p[2] < 50 * p[3];
}

// The conic through five points, A x^2 + B x y + C y^2 + D x + E y + F = 0, if it is an ellipse.
bool solve(Doubles points, std::span<double> p) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < 5; ++i) mean += Eigen::Vector2d(points[2 * i], points[2 * i + 1]) / 5;
  Eigen::Matrix<double, 5, 6> rows;
  for (int i = 0; i < 5; ++i) {
    const auto at = static_cast<std::size_t>(2 * i);
    const double x = points[at] - mean.x(), y = points[at + 1] - mean.y();
    rows.row(i) << x * x, x * y, y * y, x, y, 1;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 5, 6>> lu(rows);
  if (lu.dimensionOfKernel() != 1) return false;
  const Eigen::Matrix<double, 6, 1> k = lu.kernel().col(0);
  Eigen::Matrix2d shape;
  shape << k[0], k[1] / 2, k[1] / 2, k[2];
  if (!(shape.determinant() > 0)) return false;
  const Eigen::Vector2d centre = shape.inverse() * Eigen::Vector2d(-k[3] / 2, -k[4] / 2);
  const double size = centre.dot(shape * centre) - k[5];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(shape / size);
  if (!(axes.eigenvalues().minCoeff() > 0)) return false;
  p[0] = centre.x() + mean.x();
  p[1] = centre.y() + mean.y();
  p[2] = 1 / std::sqrt(axes.eigenvalues()[0]);
  p[3] = 1 / std::sqrt(axes.eigenvalues()[1]);
  p[4] = std::atan2(axes.eigenvectors()(1, 0), axes.eigenvectors()(0, 0));
  return true;
}

// Three in four of the points on three ellipses, the others anywhere.
constexpr std::array<std::array<double, kParameters>, 3> kTruth{{{30, 35, 20, 10, 0.4}, {65, 60, 15, 12, 1.8}, {50, 20, 30, 8, 2.9}}};

Eigen::Matrix2Xd scene() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(0, 100), turn(0, 2 * std::numbers::pi);
  std::normal_distribution<double> noise(0, 0.15);
  Eigen::Matrix2Xd points(2, 1200);
  for (int i = 0; i < 1200; ++i) {
    if (i >= 900) {
      points.col(i) = Eigen::Vector2d(anywhere(random), anywhere(random));
      continue;
    }
    const auto& e = kTruth[static_cast<std::size_t>(i % 3)];
    const double t = turn(random);
    points.col(i) = Eigen::Vector2d(e[0], e[1]) + Eigen::Rotation2Dd(e[4]) * Eigen::Vector2d(e[2] * std::cos(t), e[3] * std::sin(t)) +
                    Eigen::Vector2d(noise(random), noise(random));
  }
  return points;
}

bool finds_all(const swarmfit::FitResult& result) {
  std::size_t found = 0;
  for (const auto& truth : kTruth) {
    for (const swarmfit::Model& model : result.models) {
      const Eigen::VectorXd& p = model.parameters;
      const bool there = std::hypot(p[0] - truth[0], p[1] - truth[1]) < 0.3 && std::abs(p[2] - truth[2]) < 0.3 &&
                         std::abs(p[3] - truth[3]) < 0.3 && std::abs(std::remainder(p[4] - truth[4], std::numbers::pi)) < 0.1;
      found += there && model.inliers > 250 && model.covariance.diagonal().minCoeff() > 0 ? 1 : 0;
    }
  }
  return found == kTruth.size() && result.models.size() == kTruth.size();
}

}  // namespace

int main() {
  swarmfit::OwnModel ellipse;
  ellipse.name = "ellipse";
  ellipse.dimension = 2;
  ellipse.parameter_count = kParameters;
  ellipse.minimal_sample = 5;
  ellipse.residual = swarmfit::each_point(residual);
  ellipse.solve = solve;
  ellipse.normalise = normalise;
  ellipse.glsl = kGlsl;

  swarmfit::FitOptions options;
  options.model = swarmfit::ModelType::own;
  options.own = ellipse;
  options.threshold = 0.5;  // in the points' unit

  const Eigen::Matrix2Xd points = scene();
  bool right = true;
  for (const char* backend : {"reference", "cpu", "vulkan"}) {
    options.backend = backend;
    auto fitter = swarmfit::Fitter::create(options);
    if (!fitter && fitter.error().kind == swarmfit::Error::Kind::backend_unavailable) {
      std::printf("%s: left out, %s\n", backend, fitter.error().message.c_str());
      continue;
    }
    const auto result = fitter ? fitter->fit(swarmfit::PointsView(points)) : tl::unexpected(fitter.error());
    if (!result) {
      std::fprintf(stderr, "%s: %s\n", backend, result.error().message.c_str());
      return 1;
    }
    std::printf("%s\n", result->brief().c_str());
    for (const swarmfit::Model& model : result->models) {
      const Eigen::VectorXd& p = model.parameters;
      std::printf("  centre (%.2f, %.2f)  axes %.2f, %.2f  angle %.3f  %zu points\n", p[0], p[1], p[2], p[3], p[4], model.inliers);
    }
    right = right && finds_all(*result);
  }
  return right ? 0 : 1;
}
