#include "host/perception/grid.hpp"

#include <algorithm>
#include <atomic>
#include <limits>

#include <Eigen/Eigenvalues>

#include "host/common/parallel.hpp"
#include "host/models/working_points.hpp"

namespace swarmfit::perception {
namespace {

constexpr double kLargeCoordinate = 2000;  // [m] beyond this single precision is coarser than a depth sensor
constexpr int kPointsAtOnce = 16384;       // of a range that one thread works on
constexpr int kPitchStride = 8;            // [px] baseline over which the angle between pixels is measured

/// Median angle between horizontal neighbours on the same surface.
float measure_pitch(const PointGrid& grid) {
  std::vector<float> angles;
  for (int v = 0; v < grid.height; v += 8) {
    for (int u = 0; u + kPitchStride < grid.width; u += 8) {
      const auto at = static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u);
      const Eigen::Vector3f &a = grid.points[at], &b = grid.points[at + kPitchStride];
      if (!PointGrid::seen(a) || !PointGrid::seen(b)) continue;
      const float scale = std::sqrt(a.squaredNorm() * b.squaredNorm());
      if (scale > 0) angles.push_back(std::asin(std::min(1.0f, a.cross(b).norm() / scale)) / kPitchStride);
    }
  }
  if (angles.empty()) return 0;
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  return *middle;
}

template <class Scalar>
bool is_finite(const Scalar* x) {
  return std::isfinite(x[0]) && std::isfinite(x[1]) && std::isfinite(x[2]);
}

/// Finite, and as near as coordinates must be.
template <class Scalar>
bool is_near(const Scalar* x) {
  constexpr auto kMost = static_cast<Scalar>(models::kFarthest);
  return std::abs(x[0]) <= kMost && std::abs(x[1]) <= kMost && std::abs(x[2]) <= kMost;
}

template <class Scalar>
void copy_points(const std::vector<Scalar>& values, int threads, PointGrid& grid) {
  const std::size_t count = values.size() / 3;
  grid.points.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Scalar* x = &values[3 * i];
    if (!is_finite(x)) continue;
    const Eigen::Vector3d p(static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2]));
    if (p.cwiseAbs().maxCoeff() > kLargeCoordinate) grid.origin = p;
    break;
  }
  std::atomic<std::size_t> finite = 0;
  std::atomic<bool> stray = false;
  common::in_parallel(static_cast<int>(count), kPointsAtOnce, threads, [&](int first, int last) {
    std::size_t here = 0;
    bool beyond = false;
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i) {
      const Scalar* x = &values[3 * i];
      const bool near = is_near(x), good = near || is_finite(x);
      beyond |= near != good;
      here += good ? 1 : 0;
      for (int k = 0; k < 3; ++k)
        grid.points[i][k] = good ? static_cast<float>(static_cast<double>(x[k]) - grid.origin[k]) : std::numeric_limits<float>::quiet_NaN();
    }
    finite += here;
    if (beyond) stray = true;
  });
  grid.finite = finite;
  grid.stray = stray;
}

}  // namespace

PointGrid make_grid(const Cloud& frame, int threads) {
  PointGrid grid;
  if (frame.values64.empty())
    copy_points(frame.values32, threads, grid);
  else
    copy_points(frame.values64, threads, grid);
  grid.width = frame.organised() ? frame.width : static_cast<int>(grid.points.size());
  grid.height = frame.organised() ? frame.height : 1;
  if (grid.organised()) grid.pitch = measure_pitch(grid);
  return grid;
}

namespace {

/// at(k): the k-th of `count` points.
template <class At>
PlaneFit fit_plane_to(std::size_t count, const Eigen::Vector3d& side, At&& at) {
  PlaneFit fit{side, Eigen::Vector3d::Zero()};
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < count; ++k) fit.mean += at(k);
  fit.mean /= static_cast<double>(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector3d d = at(k) - fit.mean;
    spread += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  fit.normal = solver.eigenvectors().col(0);
  if (fit.normal.dot(side) < 0) fit.normal = -fit.normal;
  fit.square = std::max(solver.eigenvalues()[0], 0.0) / static_cast<double>(count);
  return fit;
}

}  // namespace

PlaneFit fit_plane(std::span<const Eigen::Vector3f> points, std::span<const std::uint32_t> members, const Eigen::Vector3d& side) {
  return fit_plane_to(members.size(), side, [&](std::size_t k) -> Eigen::Vector3d { return points[members[k]].cast<double>(); });
}

PlaneFit fit_plane(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& side) {
  return fit_plane_to(points.size(), side, [&](std::size_t k) -> const Eigen::Vector3d& { return points[k]; });
}

}  // namespace swarmfit::perception
