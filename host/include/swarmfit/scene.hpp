// Synthetic scenes with a known truth: for the demo, tests and benchmarks.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/cloud.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

/// Truth of a scene point by point and model by model; labels hold where the depth is missing, too.
struct SceneTruth {
  std::vector<Eigen::Vector4d> planes;       ///< n, offset of each supporting surface, n up, in the camera's frame [m]
  std::vector<std::uint16_t> plane_labels;   ///< one a pixel: 0, or k for the k-th supporting surface
  std::vector<std::uint16_t> object_labels;  ///< one a pixel: 0, or k for the k-th object
  std::size_t objects = 0;
  std::vector<std::uint16_t> object_planes;  ///< the supporting surface each object stands on, 1-based
  std::vector<std::string> object_names;     ///< "mug", "can", "carton" ...; one an object
  std::vector<std::uint16_t> object_ids;     ///< its number in the room, the same from every view; one an object
};

/// What is printed on the front of one of the scene's cartons, seen straight on: an entry for a recogniser's gallery.
struct ScenePicture {
  std::string name;          ///< "carton1" ...
  std::uint16_t object = 0;  ///< truth label of the thing that carries it; 0: it is hardly seen
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 a pixel
};

struct Scene {
  Cloud cloud;
  SceneTruth truth;
  std::vector<ScenePicture> pictures;
};

/// A loaded shelf beside a loaded table on a floor before a wall, seen by a depth camera: noise that grows with depth squared, holes
/// at depth edges, patches that return nothing. The camera looks down by 30 degrees. The same seed gives the same scene on every machine.
SWARMFIT_API Scene make_room_scene(std::uint64_t seed = 1, int width = 640, int height = 480);

/// Where the camera stands in the room (x right, y towards the wall, z up) [m].
struct SceneCamera {
  Eigen::Vector3d eye = Eigen::Vector3d(0, 0, 1.5);
  double pan = 0;              ///< tangent of half the angle it is turned to the left
  std::uint64_t exposure = 0;  ///< each picture has noise of its own
};

/// The same room from another place.
SWARMFIT_API Scene make_room_scene(std::uint64_t seed, int width, int height, const SceneCamera& camera);
/// The k-th of `frames` places on a round walk before the table, at walking pace for 300 frames; the 0-th is make_room_scene's.
SWARMFIT_API SceneCamera walk_in_room(std::size_t k, std::size_t frames);

}  // namespace swarmfit
