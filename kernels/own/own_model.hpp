// A model that its user brought along at run time, as back ends see it: what it is called here is ModelKind::own.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "kernels/models/models.hpp"

namespace swarmfit::kernels {

struct OwnModel {
  std::string name;         ///< for messages
  int dimension = 0;        ///< columns of a point
  int parameter_count = 0;  ///< at most kMaxParameters
  /// residuals[i] of rows of `dimension` columns; called from several threads at a time. Any sign; NaN is out of any reach.
  std::function<void(std::span<const double> rows, std::span<const double> parameters, std::span<double> residuals)> residual;
  /// Optional: parameters of the same model for points from which `centre` is taken away. Without it points are taken as they come.
  std::function<void(std::span<const double> centre, std::span<double> parameters)> recentre;
  /// Defines float residual(vecD x, float p[parameter_count]), D the dimension; empty where no device is to have it.
  std::string glsl;

  ModelTraits traits() const noexcept { return {"own", dimension, parameter_count, parameter_count, 0, false, false}; }
};

/// One own model, ready to be measured against points that have had `centre` taken away.
class OwnDistances {
 public:
  /// `own` must outlive this.
  OwnDistances(const OwnModel& own, std::span<const double> parameters, const double* centre);

  /// Whether all parameters are finite, here and there.
  bool usable() const noexcept { return usable_; }
  std::span<const double> parameters() const noexcept { return parameters_; }
  /// |dist| of each row; infinite where the model is not usable or its residual is no number.
  void operator()(std::span<const double> rows, std::span<double> distances) const;

 private:
  const OwnModel& own_;
  std::vector<double> parameters_;
  bool usable_;
};

}  // namespace swarmfit::kernels
