// Synthetic scenes with a known truth: for the demo, tests and benchmarks.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/cloud.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

/// Truth of a scene point by point and model by model.
struct SceneTruth {
  std::vector<Eigen::Vector4d> planes;       ///< n, offset of each supporting surface [m]
  std::vector<std::uint16_t> plane_labels;   ///< one a pixel: 0, or k for the k-th supporting surface
  std::vector<std::uint16_t> object_labels;  ///< one a pixel: 0, or k for the k-th object
  std::size_t objects = 0;
};

struct Scene {
  Cloud cloud;
  SceneTruth truth;
};

/// A loaded shelf beside a loaded table on a floor before a wall, seen by a depth camera: noise that grows with depth squared, holes
/// at depth edges, patches that return nothing. The same seed gives the same scene.
SWARMFIT_API Scene make_room_scene(std::uint64_t seed = 1, int width = 640, int height = 480);

}  // namespace swarmfit
