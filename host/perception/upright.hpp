// What in the picture stands upright: edges of things, legs, posts, whose images meet in the vertical's vanishing point.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/cloud.hpp>

#include "host/perception/grid.hpp"

namespace swarmfit::perception {

/// Straight edges in a picture, on the plane one unit before the camera: a pixel with the point p is at p / p.z there.
struct ImageEdges {
  struct Edge {
    Eigen::Vector2d middle, along;  ///< along: unit
    double length = 0;              ///< [px]
  };
  std::vector<Edge> list;
  double length = 0;  ///< of all together [px]

  /// Share of the edges, by length, that would be images of lines with this direction, in [0, 1].
  double share_along(const Eigen::Vector3d& direction) const;
};

/// Empty without a picture, without depth, or where the cloud is not in the frame of a pinhole camera.
ImageEdges find_edges(const Cloud& frame, const PointGrid& grid);

}  // namespace swarmfit::perception
