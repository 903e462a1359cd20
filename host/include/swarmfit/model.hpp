// A fitted model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

enum class ModelType {
  line2d,       ///< points (x, y); parameters a, b, offset: a x + b y + offset = 0, a^2 + b^2 = 1
  plane,        ///< points (x, y, z); parameters nx, ny, nz, offset: n . x + offset = 0, |n| = 1
  circle2d,     ///< points (x, y); parameters cx, cy, radius
  sphere,       ///< points (x, y, z); parameters cx, cy, cz, radius
  cylinder,     ///< points (x, y, z); parameters px, py, pz, ax, ay, az, radius: a point of the axis, its unit direction
  homography,   ///< points (x1, y1, x2, y2) [px]; parameters H row by row, |H| = 1: (x2, y2, 1) ~ H (x1, y1, 1)
  fundamental,  ///< points (x1, y1, x2, y2) [px]; parameters F row by row, |F| = 1: (x2, y2, 1) F (x1, y1, 1)^T = 0, of rank 2
  own,          ///< a model of your own, FitOptions::own; its parameters are what its functions make of them
};

/// The name used on the command line and in result.json.
SWARMFIT_API std::string_view name(ModelType type) noexcept;
/// Fails with invalid_option, naming what there is.
SWARMFIT_API Expected<ModelType> model_type(std::string_view name);
/// Several kinds, their names parted by commas. Fails with invalid_option.
SWARMFIT_API Expected<std::vector<ModelType>> model_types(std::string_view names);
/// Every kind that is built in.
SWARMFIT_API std::span<const ModelType> model_types() noexcept;
/// Columns of a point the kind is fitted to; 0 for `own`, where OwnModel::dimension tells.
SWARMFIT_API int dimension(ModelType type) noexcept;

struct Model {
  ModelType type = ModelType::plane;
  Eigen::VectorXd parameters;   ///< as listed at ModelType, in the data's frame and unit
  std::size_t inliers = 0;      ///< points labelled with this model
  double cost = 0;              ///< truncated loss over all points under the caps it was found with [data unit]
  double rms = 0;               ///< of its inliers' distances [data unit]
  Eigen::MatrixXd covariance;   ///< of `parameters`, parameter_count x parameter_count, from the inliers' residuals
  bool supporting = false;      ///< set by perception: horizontal, and of reasonable size
  std::size_t iterations = 0;   ///< swarm steps spent on it; 0 where the joint end made it of what all swarms had come to
  std::size_t evaluations = 0;  ///< particles scored for it; 0 there, and where it was found while the threshold was estimated
  double points_touched = 1;    ///< share of points x particles really computed, in [0, 1]
  double found_at_ms = 0;       ///< since the start of the fit
  std::uint64_t id = 0;         ///< set by perception where frames follow each other: 1, 2 ..., the same plane over frames

  /// plane: the unit normal; line2d: the unit normal with z = 0. Of these two only.
  Eigen::Vector3d normal() const {
    return type == ModelType::plane ? Eigen::Vector3d(parameters.head<3>()) : Eigen::Vector3d(parameters[0], parameters[1], 0);
  }
  /// plane, line2d: offset in normal . x + offset = 0. Of these two only.
  double offset() const { return parameters[parameters.size() - 1]; }
};

}  // namespace swarmfit
