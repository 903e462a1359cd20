// Pop-out: points that stick out above a supporting surface, grouped by a 3D flood fill.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/perception/grid.hpp"
#include "host/perception/surface.hpp"

namespace swarmfit::perception {

struct PopoutOptions {
  double min_height = 0.008;     ///< [m]
  double max_height = 1.0;       ///< [m]
  double flood_step = 0.02;      ///< [m]
  std::size_t min_points = 300;  ///< of a group, at the cloud's own resolution
  int threads = 0;               ///< 0: as many as there are
};

/// Which surface a point stands above, the low fringe included, and whether surely so, so that more can grow from it.
struct Standing {
  std::uint8_t surface = 0;  ///< 0: none, s + 1: the surface s
  std::uint8_t sure = 0;     ///< 1: surely
};

struct Popout {
  std::vector<std::uint16_t> group;  ///< one a point: 0, or k for the k-th group
  std::vector<int> support;          ///< one a group: 0-based index into the surfaces
  std::vector<std::size_t> size;     ///< one a group
  std::vector<Standing> standing;    ///< one a point
};

/// Groups of points above `surfaces`, within their extent, up to the next surface and `max_height`.
Popout pop_out(const PointGrid& grid, std::span<const Surface> surfaces, const PopoutOptions& options);

/// How far apart neighbours in the flood fill may be at this range: the step asked for, or what the sensor's sampling and noise need.
float flood_step_at(const PointGrid& grid, double noise, double flood_step, float range);

}  // namespace swarmfit::perception
