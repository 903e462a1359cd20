// The extent of a supporting plane: where on the infinite plane there is something to stand on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/perception/grid.hpp"

namespace swarmfit::perception {

/// One plane's surfaces as a bitmap in the plane's own coordinates. A plane may carry several (two tables of one height).
struct Surface {
  LocalPlane plane;
  int model = 0;  ///< 1-based index into the fit's models
  Eigen::Vector3f axis_a = Eigen::Vector3f::UnitX(), axis_b = Eigen::Vector3f::UnitY();
  Eigen::Vector2f low = Eigen::Vector2f::Zero();
  float cell = 0;       ///< [m]
  float per_metre = 0;  ///< cells, 1 / cell
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> extent;     ///< 2 well within a surface's hull, 1 at its edge and in the margin, row after row
  std::vector<std::uint8_t> component;  ///< 1 on cells of a kept surface, without the hull; what is connected with the plane
  double area = 0;                      ///< seen by the sensor, all kept surfaces [m^2]
  double piece_area = 0;                ///< hull of the largest unbroken piece [m^2]
  double piece_length = 0;              ///< of that piece, along its principal axis [m]
  double noise = 0;                     ///< standard deviation of the inliers' heights at a range of one metre; grows with its square

  /// In the plane's own coordinates [m].
  Eigen::Vector2f place_of(const Eigen::Vector3f& p) const noexcept { return {axis_a.dot(p), axis_b.dot(p)}; }
  /// Its place in the bitmap, or -1 outside.
  int cell_of(const Eigen::Vector3f& p) const noexcept { return cell_at(place_of(p)); }
  int cell_at(const Eigen::Vector2f& place) const noexcept {
    const float a = (place.x() - low.x()) * per_metre, b = (place.y() - low.y()) * per_metre;
    if (!(a >= 0 && b >= 0 && a < static_cast<float>(columns) && b < static_cast<float>(rows))) return -1;
    return static_cast<int>(b) * columns + static_cast<int>(a);
  }
  bool contains(const Eigen::Vector3f& p) const noexcept {
    const int at = cell_of(p);
    return at >= 0 && extent[static_cast<std::size_t>(at)] != 0;
  }
  bool on_component(const Eigen::Vector3f& p) const noexcept {
    const int at = cell_of(p);
    return at >= 0 && component[static_cast<std::size_t>(at)] != 0;
  }
  /// 1 on cells that have a kept surface's cell within `reach` [m] along both axes.
  std::vector<std::uint8_t> near_component(float reach) const;
  bool at_edge(const Eigen::Vector3f& p) const noexcept {
    const int at = cell_of(p);
    return at < 0 || extent[static_cast<std::size_t>(at)] < 2;
  }
  /// Standard deviation of a height measured at this range.
  float sigma(float range) const noexcept { return sigma_at(range * range); }
  float sigma_at(float range_squared) const noexcept { return static_cast<float>(noise) * std::max(0.25f, range_squared); }
};

/// A plane with its axes, no bitmap yet.
Surface lay_axes(const LocalPlane& plane, int model);

/// The bitmap of points at these places. `margin` [m] widens the hull.
void fill_surface(std::span<const Eigen::Vector2f> places, double margin, Surface& surface);

/// Both, of the points with labels[i] == model.
Surface make_surface(const PointGrid& grid, std::span<const std::uint16_t> labels, int model, const LocalPlane& plane, double margin);

/// Standard deviation of the heights of the surface's points at a range of one metre, robustly.
double measure_noise(const PointGrid& grid, std::span<const std::uint16_t> labels, const Surface& surface);

/// Which surfaces support: of reasonable size, and not the tops of things that stand on a larger one. `grid` is the frame in which they lie:
/// below the borders of tops it has the things' sides.
std::vector<bool> choose_supporting(const PointGrid& grid, std::span<const Surface> surfaces, double max_height);

}  // namespace swarmfit::perception
