// A frame's points as the perception works on them: single precision near a local origin, on the image grid where there is one.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <swarmfit/cloud.hpp>

namespace swarmfit::perception {

struct PointGrid {
  int width = 0, height = 0;                         ///< height 1: no image grid
  std::vector<Eigen::Vector3f> points;               ///< relative to `origin`; NaN where the sensor saw nothing
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< not zero only where the coordinates are too large for single precision
  std::size_t finite = 0;
  bool stray = false;  ///< a finite point is farther than numbers can be worked with, models::kFarthest
  float pitch = 0;     ///< angle between neighbouring pixels [rad]; unorganised: 0

  bool organised() const noexcept { return height > 1; }
  std::size_t size() const noexcept { return points.size(); }
  static bool seen(const Eigen::Vector3f& p) noexcept { return std::isfinite(p.x() + p.y() + p.z()); }
  /// Distance from the camera, which an organised cloud has at its origin [m].
  static float range(const Eigen::Vector3f& p) noexcept { return p.norm(); }
};

/// n . x + d = 0 in the grid's local frame, n towards up.
struct LocalPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float offset = 0;
  float height(const Eigen::Vector3f& p) const noexcept { return normal.dot(p) + offset; }
};

/// The plane of least squares through points: their mean is on it.
struct PlaneFit {
  Eigen::Vector3d normal, mean;
  double square = 0;  ///< mean of the squared distances
  LocalPlane plane() const { return {normal.cast<float>(), static_cast<float>(-normal.dot(mean))}; }
};
/// Through those of the points that are listed, three at least; its normal is on the side of `side`.
PlaneFit fit_plane(std::span<const Eigen::Vector3f> points, std::span<const std::uint32_t> members, const Eigen::Vector3d& side);
/// Through all of them.
PlaneFit fit_plane(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& side);

PointGrid make_grid(const Cloud& frame, int threads = 0);

}  // namespace swarmfit::perception
