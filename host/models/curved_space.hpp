// What the kinds without a closed least-squares form share: Gauss-Newton steps on a local chart, and the covariance that comes with it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "host/models/model_space.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::models {

/// The points of a support in the working frame. Few are kept, for every step runs over them again; many are read anew each time.
class SupportRows {
 public:
  using Room = std::array<double, kMaxDimension>;

  SupportRows(const WorkingPoints& points, const Weighted& support);

  std::size_t size() const noexcept { return support_.index.size(); }
  double weight(std::size_t k) const noexcept { return support_.weight[k]; }
  /// visit(rows, weights) on runs of points, which together are all.
  template <class Visit>
  void in_runs(Visit&& visit) const;
  /// Columns of point k, in `room` where they are not kept.
  const double* row(std::size_t k, Room& room) const noexcept {
    if (!kept_.empty()) return kept_.data() + k * width_;
    for (std::size_t d = 0; d < width_; ++d) room[d] = points_.at(support_.index[k], static_cast<int>(d));
    return room.data();
  }

 private:
  const WorkingPoints& points_;
  Weighted support_;
  std::size_t width_;
  kernels::Reused<double> kept_;
};

template <class Visit>
void SupportRows::in_runs(Visit&& visit) const {
  if (!kept_.empty()) return visit(std::span<const double>(kept_), support_.weight);
  constexpr std::size_t kRun = 512;
  kernels::Reused<double> rows;
  Room room;
  for (std::size_t first = 0; first < size(); first += kRun) {
    const std::size_t count = std::min(kRun, size() - first);
    rows.clear();
    for (std::size_t k = first; k < first + count; ++k) {
      const double* const from = row(k, room);
      rows.insert(rows.end(), from, from + width_);
    }
    visit(std::span<const double>(rows), support_.weight.subspan(first, count));
  }
}

/// A kind whose residual is linearised around a position, as `Linearised` does. Chart: `freedom()` numbers near 0, the position itself
/// being 0.
class CurvedSpace : public ModelSpace {
 public:
  static constexpr int kMostFreedom = 8;
  static constexpr int kMostParameters = 9;

  using Basis = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostParameters, kMostFreedom>;

  double distance(const Position& a, const Position& b) const override;
  bool refine(const WorkingPoints& points, const Weighted& support, Position& theta) const override;
  Covariance unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const override;
  double noise_variance(const WorkingPoints& points, const Weighted& support, const Position& theta, double squares) const override;
  Covariance covariance_to_data(const Covariance& covariance, const Position& theta, const Frame& frame) const override;

 protected:
  /// Derivative of the position's entries by the chart, parameter_count() x freedom().
  virtual Basis basis(const Position& theta) const = 0;
  /// The position at `step` of the chart around theta.
  virtual Position retract(const Position& theta, const Position& step) const = 0;

  using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFreedom, kMostFreedom>;
  using Gradient = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostFreedom, 1>;
  struct Equations {
    Normal information;  ///< J^T W J over the chart
    Gradient gradient;   ///< J^T W r
    double squares = 0;  ///< r^T W r
    std::size_t used = 0;
  };
  virtual Equations equations(const SupportRows& support, const Position& theta) const = 0;
  /// r^T W r; infinite where the residual is not defined at a point.
  virtual double squares(const SupportRows& support, const Position& theta) const = 0;
};

/// The sums of a kind of one residual a point whose sizes are known at compile time: they run over every point of the support at each step, and are most of what a
/// refinement takes. `Kind` has `bool linearise(row, theta, Linear&) const`, row the point's columns, false where the residual is not
/// defined at this point, which then has no say.
template <class Kind, int Parameters>
class Linearised : public CurvedSpace {
 protected:
  using Row = Eigen::Matrix<double, 1, Parameters>;
  /// Residual of one point, whitened: under equal independent noise in every column it has that noise's deviation.
  struct Linear {
    double residual;
    Row by_parameter;  ///< derivative by the position's entries
  };

  int residual_components() const noexcept override { return 1; }

  bool residual(const WorkingPoints& points, std::uint32_t index, const Position& theta, std::span<double> components) const override {
    std::array<double, kMaxDimension> row{};
    for (int d = 0; d < points.dimension(); ++d) row[static_cast<std::size_t>(d)] = points.at(index, d);
    Linear at;
    if (!itself().linearise(row.data(), theta, at)) return false;
    components[0] = at.residual;
    return true;
  }

  Equations equations(const SupportRows& support, const Position& theta) const override {
    Eigen::Matrix<double, Parameters, Parameters> information = Eigen::Matrix<double, Parameters, Parameters>::Zero();
    Eigen::Matrix<double, Parameters, 1> gradient = Eigen::Matrix<double, Parameters, 1>::Zero();
    Equations sum;
    Linear at;
    at.by_parameter.setZero();
    SupportRows::Room room;
    for (std::size_t k = 0; k < support.size(); ++k) {
      if (!itself().linearise(support.row(k, room), theta, at)) continue;
      const double w = support.weight(k);
      const Row& row = at.by_parameter;
      for (int c = 0; c < Parameters; ++c) information.col(c) += (w * row[c]) * row.transpose();
      gradient += (w * at.residual) * row.transpose();
      sum.squares += w * at.residual * at.residual;
      ++sum.used;
    }
    const Basis chart = this->basis(theta);
    sum.information = chart.transpose() * information * chart;
    sum.gradient = chart.transpose() * gradient;
    return sum;
  }

  double squares(const SupportRows& support, const Position& theta) const override {
    double sum = 0;
    Linear at;
    SupportRows::Room room;
    for (std::size_t k = 0; k < support.size(); ++k) {
      if (!itself().linearise(support.row(k, room), theta, at)) return std::numeric_limits<double>::infinity();
      sum += support.weight(k) * (at.residual * at.residual);
    }
    return sum;
  }

 private:
  const Kind& itself() const noexcept { return static_cast<const Kind&>(*this); }
};

}  // namespace swarmfit::models
