#include "host/models/curved_space.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "kernels/reused.hpp"

namespace swarmfit::models {
namespace {

constexpr int kSteps = 3;             // of Gauss-Newton; starting points are good, and callers reweight and repeat
constexpr int kHalvings = 4;          // of damping before a step is given up
constexpr double kSettled = 1e-4;     // relative fall of the squares below which steps end; callers reweight, or fit again
constexpr double kLeastRank = 1e-12;  // of the information matrix: below, the points do not determine the model

constexpr std::size_t kKept = std::size_t{1} << 16;  // points of a support that are kept: 2 MiB at most

}  // namespace

SupportRows::SupportRows(const WorkingPoints& points, const Weighted& support)
    : points_(points), support_(support), width_(static_cast<std::size_t>(points.dimension())) {
  if (size() > kKept) return;
  kernels::Reused<double> rows;
  rows.reserve(size() * width_);
  const auto keep = [&]<std::size_t D>(std::integral_constant<std::size_t, D>) {
    for (const std::uint32_t i : support.index) {
      const std::array<double, D> row = points.row<D>(i);
      rows.insert(rows.end(), row.begin(), row.end());
    }
  };
  switch (width_) {
    case 2: keep(std::integral_constant<std::size_t, 2>()); break;
    case 3: keep(std::integral_constant<std::size_t, 3>()); break;
    default: keep(std::integral_constant<std::size_t, 4>());
  }
  kept_ = std::move(rows);
}

double CurvedSpace::distance(const Position& a, const Position& b) const {
  Position v(parameter_count());
  difference(a, b, v);
  return v.norm();
}

bool CurvedSpace::refine(const WorkingPoints& points, const Weighted& support, Position& theta) const {
  const auto least = static_cast<std::size_t>((freedom() + residual_components() - 1) / residual_components());
  if (support.index.size() < least) return false;
  const SupportRows rows(points, support);
  Position best = theta;
  double damping = 1e-6;
  bool moved = false;
  for (int step = 0; step < kSteps; ++step) {
    const Equations at = equations(rows, best);
    if (at.used < least || !at.information.allFinite()) break;
    bool better = false;
    for (int attempt = 0; attempt < kHalvings && !better; ++attempt, damping *= 100) {
      Normal damped = at.information;
      damped.diagonal() *= 1 + damping;
      const Eigen::LDLT<Normal> solver(damped);
      if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > kLeastRank * solver.vectorD().maxCoeff())) return moved;
      const Position by = solver.solve(-at.gradient);
      Position candidate = retract(best, by);
      if (!candidate.allFinite() || !admit(candidate)) continue;
      const double now = squares(rows, candidate);
      if (!(now < at.squares)) continue;
      better = moved = true;
      best = candidate;
      damping = std::max(damping * 1e-3, 1e-9);
      if (at.squares - now < kSettled * at.squares) step = kSteps;
      break;
    }
    if (!better) break;
  }
  // Where no step helped, the position is the minimum already.
  theta = best;
  return theta.allFinite();
}

Covariance CurvedSpace::unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const {
  const Equations at = equations({points, support}, theta);
  const Basis chart = basis(theta);
  const Covariance information = at.information;
  return chart * information.completeOrthogonalDecomposition().pseudoInverse() * chart.transpose();
}

double CurvedSpace::noise_variance(const WorkingPoints& points, const Weighted& support, const Position& theta, double) const {
  const double degrees = static_cast<double>(support.index.size()) * residual_components() - freedom();
  return squares({points, support}, theta) / std::max(1.0, degrees);
}

Covariance CurvedSpace::covariance_to_data(const Covariance& covariance, const Position& theta, const Frame& frame) const {
  // to_data is smooth and well scaled in the working frame: central differences lose nothing that a covariance would show.
  constexpr double kStep = 1e-5;
  const int n = parameter_count();
  Covariance jacobian(n, n);
  for (int i = 0; i < n; ++i) {
    Position ahead = theta, behind = theta;
    ahead[i] += kStep;
    behind[i] -= kStep;
    Position a = to_data(ahead, frame), b = to_data(behind, frame);
    jacobian.col(i) = (a - b) / (2 * kStep);
  }
  return jacobian * covariance * jacobian.transpose();
}

}  // namespace swarmfit::models
