// What the kinds without a closed least-squares form share: Gauss-Newton steps on a local chart, and the covariance that comes with it.
#pragma once

#include <array>

#include <Eigen/Dense>

#include "host/models/model_space.hpp"

namespace swarmfit::models {

/// A kind whose residual is linearised around a position. Chart: `freedom()` numbers near 0, the position itself being 0.
class CurvedSpace : public ModelSpace {
 public:
  static constexpr int kMostComponents = 2;
  static constexpr int kMostFreedom = 8;
  static constexpr int kMostParameters = 9;

  /// Residual components of one point, whitened: under equal independent noise in every column each has that noise's deviation.
  struct Linear {
    Eigen::Matrix<double, kMostComponents, 1> residual;
    Eigen::Matrix<double, kMostComponents, kMostParameters> by_parameter;  ///< derivative by the position's entries
  };
  using Basis = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostParameters, kMostFreedom>;

  double distance(const Position& a, const Position& b) const override;
  bool refine(const WorkingPoints& points, const Weighted& support, Position& theta) const override;
  Eigen::MatrixXd unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const override;
  double noise_variance(const WorkingPoints& points, const Weighted& support, const Position& theta, double squares) const override;
  Eigen::MatrixXd covariance_to_data(const Eigen::MatrixXd& covariance, const Position& theta, const Frame& frame) const override;

 protected:
  /// Independent residual components of a point: 1 for a surface, 2 where a point must land on a point.
  virtual int components() const noexcept { return 1; }
  /// False where the residual is not defined at this point, which then has no say.
  virtual bool linearise(const WorkingPoints& points, std::uint32_t point, const Position& theta, Linear& at) const = 0;
  /// Derivative of the position's entries by the chart, parameter_count() x freedom().
  virtual Basis basis(const Position& theta) const = 0;
  /// The position at `step` of the chart around theta.
  virtual Position retract(const Position& theta, const Position& step) const = 0;

 private:
  using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostFreedom, kMostFreedom>;
  using Chart = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostFreedom, 1>;
  struct Equations {
    Normal information;  ///< J^T W J
    Chart gradient;      ///< J^T W r
    double squares = 0;  ///< r^T W r
    std::size_t used = 0;
  };
  Equations equations(const WorkingPoints& points, const Weighted& support, const Position& theta) const;
  double squares(const WorkingPoints& points, const Weighted& support, const Position& theta) const;
};

}  // namespace swarmfit::models
