// The direction of the surface at each cell of a stereo cloud.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/perception/grid.hpp"

namespace swarmfit::perception {

/// Unit normals towards the camera, one a cell; zero where the surface bends, ends, or too little around is `textured` (1 a cell with
/// something to match). A plane's inverse range is linear in the ray it is seen along: over a window of cells it is fitted where the error
/// of stereo is the same everywhere, in disparity.
std::vector<Eigen::Vector3f> stereo_normals(const PointGrid& cells, std::span<const std::uint8_t> textured, int threads = 0);

}  // namespace swarmfit::perception
