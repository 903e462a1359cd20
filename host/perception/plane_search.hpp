// Horizontal planes of a frame through the fitter: looked for among the cells that lie flat, settled over all points.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

#include "host/perception/grid.hpp"
#include "host/perception/overview.hpp"
#include "host/perception/surface.hpp"

namespace swarmfit::perception {

/// Whether the planes found so far tell what was asked, whatever another plane, of so many cells at most, would say.
using PlanesSuffice = std::function<bool(std::span<const Model> planes, std::size_t cells_left)>;

/// Planes of any direction, each with the number of cells that lie in it and along it as its inliers; what the vertical is chosen from. The
/// search ends early where they `suffice`.
Expected<FitResult> find_any_planes(Fitter& fitter, const Overview& overview, const PlanesSuffice& suffice, const std::stop_token& stop);

struct PlaneSearch {
  FitResult fit;                  ///< models with normals up, labels of all points, supporting ones marked
  std::vector<Surface> supports;  ///< of the supporting models
};

/// One horizontal plane after another until none of reasonable size is left. `warm_start`: planes that seed the swarm, in the grid's frame.
Expected<PlaneSearch> find_supports(Fitter& fitter, const PointGrid& grid, const Overview& overview, const Eigen::Vector3d& up,
                                    const PerceiveOptions& options, const ModelCallback& on_plane, const std::stop_token& stop,
                                    const std::vector<Model>& warm_start = {});

}  // namespace swarmfit::perception
