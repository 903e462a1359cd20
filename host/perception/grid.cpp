#include "host/perception/grid.hpp"

#include <algorithm>
#include <limits>

namespace swarmfit::perception {
namespace {

constexpr double kLargeCoordinate = 2000;  // [m] beyond this single precision is coarser than a depth sensor
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
void copy_points(const std::vector<Scalar>& values, PointGrid& grid) {
  const std::size_t count = values.size() / 3;
  grid.points.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isfinite(values[3 * i]) && std::isfinite(values[3 * i + 1]) && std::isfinite(values[3 * i + 2])) {
      const Eigen::Vector3d p(static_cast<double>(values[3 * i]), static_cast<double>(values[3 * i + 1]),
                              static_cast<double>(values[3 * i + 2]));
      if (grid.finite++ == 0 && p.cwiseAbs().maxCoeff() > kLargeCoordinate) grid.origin = p;
      grid.points[i] = (p - grid.origin).cast<float>();
    } else {
      grid.points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  }
}

}  // namespace

PointGrid make_grid(const Cloud& frame) {
  PointGrid grid;
  if (frame.values64.empty())
    copy_points(frame.values32, grid);
  else
    copy_points(frame.values64, grid);
  grid.width = frame.organised() ? frame.width : static_cast<int>(grid.points.size());
  grid.height = frame.organised() ? frame.height : 1;
  if (grid.organised()) grid.pitch = measure_pitch(grid);
  return grid;
}

}  // namespace swarmfit::perception
