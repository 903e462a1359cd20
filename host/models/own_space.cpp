// The space of a user's own model: positions are its parameters, about the cloud's centre where the user told how to move them there.
// Nothing is known of their units, so nothing here depends on them.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "host/models/model_space.hpp"

namespace swarmfit::models {
namespace {

constexpr int kSteps = 8;              // of Gauss-Newton; starting points are good, and callers repeat
constexpr int kAttempts = 5;           // of damping before a step is given up
constexpr double kSettled = 1e-7;      // relative fall of the squares below which steps end
constexpr double kLeastEigen = 1e-11;  // of the scaled information: below, the points do not tell that direction
constexpr double kNudge = 1e-5;        // of the cloud's spread: how far a parameter's change moves residuals when they are differentiated
constexpr int kTries = 6;              // of a change's size
constexpr std::size_t kAsked = 64;     // points that tell its effect

std::span<double> values(Position& theta) { return {theta.data(), static_cast<std::size_t>(theta.size())}; }
std::span<const double> values(const Position& theta) { return {theta.data(), static_cast<std::size_t>(theta.size())}; }

/// Rows of points with their weights.
struct Rows {
  std::vector<double> points;
  std::span<const double> weights;
  std::size_t count() const noexcept { return weights.size(); }
};

/// The linearised problem in parameters scaled so that each column of the Jacobian has unit length.
struct Problem {
  Eigen::VectorXd unit;         // of each parameter; 0 where it changes nothing
  Eigen::VectorXd eigenvalues;  // of the directions that the points tell, and only as many as there are degrees of freedom
  Eigen::MatrixXd directions;
  Eigen::VectorXd gradient;  // scaled
  double squares = 0;
};

class OwnSpace final : public ModelSpace {
 public:
  explicit OwnSpace(const OwnModel& own) : own_(own), freedom_(own.freedom > 0 ? own.freedom : own.parameter_count) {}

  ModelType type() const noexcept override { return ModelType::own; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::own; }
  std::string_view title() const noexcept override { return own_.name; }
  int minimal_sample() const noexcept override { return own_.minimal_sample; }
  int parameter_count() const noexcept override { return own_.parameter_count; }
  int least_rank() const noexcept override { return 0; }
  int freedom() const noexcept override { return freedom_; }

  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    theta = Position::Zero(own_.parameter_count);
    return own_.solve(rows_of(points, sample), values(theta)) && admit(theta);
  }

  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override { velocity = to - from; }
  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override { theta += velocity; }
  double distance(const Position& a, const Position& b) const override { return (a - b).norm(); }

  bool refine(const WorkingPoints& points, const Weighted& support, Position& theta) const override {
    if (support.index.size() < static_cast<std::size_t>(freedom_)) return false;
    const Rows rows{rows_of(points, support.index), support.weight};
    if (own_.refine) {
      Position refined = theta;
      if (!own_.refine(rows.points, rows.weights, values(refined)) || !admit(refined)) return false;
      theta = refined;
      return true;
    }
    return descend(rows, points.frame().scale, theta);
  }

  Covariance unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const override {
    const Rows rows{rows_of(points, support.index), support.weight};
    const Problem at = linearise(rows, points.frame().scale, theta);
    // The residuals are in the data's unit, their variance is asked for in the working frame's.
    const double scale = points.frame().scale;
    const Eigen::MatrixXd root = at.unit.asDiagonal() * at.directions * at.eigenvalues.cwiseSqrt().cwiseInverse().asDiagonal();
    const Eigen::MatrixXd form = own_.normalise ? form_jacobian(theta, at.unit) * root : root;
    return scale * scale * (form * form.transpose());
  }

  Position to_data(const Position& theta, const Frame& frame) const override { return moved(theta, frame, -1); }
  Position from_data(const Position& parameters, const Frame& frame) const override { return moved(parameters, frame, 1); }

  Covariance covariance_to_data(const Covariance& covariance, const Position& theta, const Frame& frame) const override {
    if (!own_.recentre) return covariance;
    // Within a thousandth of a deviation each way: that far the way back is straight.
    const int n = own_.parameter_count;
    Eigen::MatrixXd jacobian(n, n);
    for (int i = 0; i < n; ++i) {
      const double step = std::max(1e-3 * std::sqrt(std::max(covariance(i, i), 0.0)), 1e-9 * std::max(std::abs(theta[i]), 1e-9));
      Position ahead = theta, behind = theta;
      ahead[i] += step;
      behind[i] -= step;
      const Position far = to_data(ahead, frame), near = to_data(behind, frame);
      jacobian.col(i) = (far - near) / (2 * step);
    }
    return jacobian * covariance * jacobian.transpose();
  }

  bool admit(Position& theta) const override {
    return theta.allFinite() && (!own_.normalise || own_.normalise(values(theta))) && theta.allFinite();
  }

 private:
  Position moved(const Position& theta, const Frame& frame, double way) const {
    if (!own_.recentre) return theta;
    Position there = theta;
    double centre[kMaxDimension];
    for (int d = 0; d < own_.dimension; ++d) centre[d] = way * frame.centre[static_cast<std::size_t>(d)];
    own_.recentre({centre, static_cast<std::size_t>(own_.dimension)}, values(there));
    if (own_.normalise) own_.normalise(values(there));
    return there;
  }

  std::vector<double> rows_of(const WorkingPoints& points, std::span<const std::uint32_t> index) const {
    std::vector<double> rows;
    rows.reserve(index.size() * static_cast<std::size_t>(own_.dimension));
    for (const std::uint32_t i : index) {
      for (int d = 0; d < own_.dimension; ++d) {
        rows.push_back(points.view().at(i, d) - (own_.recentre ? points.frame().centre[static_cast<std::size_t>(d)] : 0.0));
      }
    }
    return rows;
  }

  /// Of rows [0, count); where the parameters are no model, none is a number.
  Eigen::VectorXd residuals(const Rows& rows, std::size_t count, Position theta) const {
    Eigen::VectorXd out(static_cast<Eigen::Index>(count));
    if (!admit(theta)) return Eigen::VectorXd::Constant(out.size(), std::numeric_limits<double>::quiet_NaN());
    const auto width = static_cast<std::size_t>(own_.dimension);
    own_.residual(std::span(rows.points).first(count * width), values(std::as_const(theta)), {out.data(), count});
    return out;
  }

  double squares(const Rows& rows, const Position& theta) const {
    const Eigen::VectorXd r = residuals(rows, rows.count(), theta);
    double sum = 0;
    for (std::size_t k = 0; k < rows.count(); ++k) {
      const double one = r[static_cast<Eigen::Index>(k)];
      sum += rows.weights[k] * one * one;
    }
    return std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
  }

  /// How far to change parameter `i` so that residuals change by `wanted`; 0 where it changes none.
  double nudge(const Rows& rows, const Position& theta, int i, double wanted) const {
    const std::size_t count = std::min(rows.count(), kAsked);
    const Eigen::VectorXd here = residuals(rows, count, theta);
    double step = 1e-4 * (theta[i] != 0 ? std::abs(theta[i]) : 1.0), effect = 0;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      Position there = theta;
      there[i] += step;
      const Eigen::VectorXd change = residuals(rows, count, there) - here;
      effect = change.array().isFinite().any() ? std::sqrt(change.array().isFinite().select(change.array().square(), 0.0).mean()) : -1;
      if (effect < 0) {
        step *= 1e-3;  // out of where there are models
      } else if (effect < 1e-3 * wanted) {
        step *= 100;
      } else {
        const double factor = wanted / effect;
        step *= factor;
        if (factor > 0.1 && factor < 10) return step;
      }
    }
    return effect > 1e-2 * wanted ? step : 0;
  }

  Problem linearise(const Rows& rows, double scale, const Position& theta) const {
    const int n = own_.parameter_count;
    const auto count = static_cast<Eigen::Index>(rows.count());
    Eigen::VectorXd here = residuals(rows, rows.count(), theta);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(count, n);
    for (int i = 0; i < n; ++i) {
      const double step = nudge(rows, theta, i, kNudge * scale);
      if (step == 0) continue;
      Position ahead = theta, behind = theta;
      ahead[i] += step;
      behind[i] -= step;
      jacobian.col(i) = (residuals(rows, rows.count(), ahead) - residuals(rows, rows.count(), behind)) / (2 * step);
    }
    for (Eigen::Index k = 0; k < count; ++k) {
      const double root = std::sqrt(rows.weights[static_cast<std::size_t>(k)]);
      const bool known = std::isfinite(here[k]) && jacobian.row(k).allFinite();
      here[k] = known ? root * here[k] : 0.0;
      if (known) {
        jacobian.row(k) *= root;
      } else {
        jacobian.row(k).setZero();
      }
    }
    Problem problem;
    const Eigen::VectorXd lengths = jacobian.colwise().norm();
    problem.unit = (lengths.array() > 0).select(lengths.cwiseInverse(), 0.0);
    jacobian = jacobian * problem.unit.asDiagonal();
    problem.squares = here.squaredNorm();
    problem.gradient = jacobian.transpose() * here;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(jacobian.transpose() * jacobian);
    // Ascending: the last ones are told best.
    int kept = 0;
    while (kept < freedom_ && eigen.eigenvalues()[n - 1 - kept] > kLeastEigen * eigen.eigenvalues()[n - 1]) ++kept;
    problem.eigenvalues = eigen.eigenvalues().tail(kept);
    problem.directions = eigen.eigenvectors().rightCols(kept);
    return problem;
  }

  /// Levenberg and Marquardt's way to the least squares; false where the points determine no model.
  bool descend(const Rows& rows, double scale, Position& theta) const {
    Position best = theta;
    double damping = 1e-7;
    for (int step = 0; step < kSteps; ++step) {
      const Problem at = linearise(rows, scale, best);
      if (at.eigenvalues.size() < freedom_ || !std::isfinite(at.squares)) return false;
      const double before = squares(rows, best);
      double now = before;
      for (int attempt = 0; attempt < kAttempts && !(now < before); ++attempt, damping *= 100) {
        const Eigen::VectorXd along = at.directions.transpose() * at.gradient;
        const Eigen::VectorXd by = at.directions * (along.array() / (at.eigenvalues.array() + damping)).matrix();
        Position candidate = best - at.unit.cwiseProduct(by);
        if (!candidate.allFinite() || !admit(candidate)) continue;
        const double squared = squares(rows, candidate);
        if (!(squared < before)) continue;
        best = candidate;
        now = squared;
      }
      if (!(now < before)) break;  // the minimum already
      damping = std::max(damping * 1e-4, 1e-9);
      if (before - now < kSettled * before) break;
    }
    theta = best;
    return true;
  }

  /// Of the canonical form by the parameters.
  Eigen::MatrixXd form_jacobian(const Position& theta, const Eigen::VectorXd& unit) const {
    const int n = own_.parameter_count;
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Identity(n, n);
    for (int i = 0; i < n; ++i) {
      const double size = std::max(std::abs(theta[i]), theta.norm() * 1e-3);
      const double step = 1e-6 * (size > 0 ? size : unit[i] > 0 ? unit[i] : 1.0);
      Position ahead = theta, behind = theta;
      ahead[i] += step;
      behind[i] -= step;
      // Where the form changes sides (n to -n) between the two, the one that stays tells.
      const double most = 0.1 * theta.norm();
      const bool forth = admit(ahead) && (ahead - theta).norm() < most, back = admit(behind) && (behind - theta).norm() < most;
      if (forth && back) {
        jacobian.col(i) = (ahead - behind) / (2 * step);
      } else if (forth || back) {
        jacobian.col(i) = (forth ? ahead - theta : theta - behind) / step;
      }
    }
    return jacobian;
  }

  OwnModel own_;
  int freedom_;
};

}  // namespace

std::unique_ptr<ModelSpace> make_own_space(const OwnModel& own) { return std::make_unique<OwnSpace>(own); }

}  // namespace swarmfit::models
