// Which way is up: from gravity, from the camera's tilt, or from the planes of the first view.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <Eigen/Core>

#include <swarmfit/model.hpp>

#include "host/perception/grid.hpp"
#include "host/perception/upright.hpp"

namespace swarmfit::perception {

inline constexpr const char* kFromDominantPlane = "dominant plane";
inline constexpr const char* kFromWall = "dominant plane (a wall)";
inline constexpr const char* kFromEdges = "upright edges and walls";

struct Vertical {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< unit, against gravity
  std::string source;
};

Vertical vertical_from_gravity(const Eigen::Vector3d& gravity);

/// x right, y down, z forward; `tilt` [rad] below the horizon.
Vertical vertical_from_tilt(double tilt);

/// The direction that the planes of the view share most: each plane counts with its points, less where no upright camera could see
/// a floor or a table like that. Where only walls are seen, the image's vertical made perpendicular to the largest of them.
/// Empty where there is no plane.
std::optional<Vertical> vertical_from_planes(const PointGrid& grid, std::span<const Model> planes, double horizontal_angle);

/// The direction that best accounts for surfaces and edges together, for where planes alone do not decide: surfaces lie across it or, as
/// walls, along it, upright edges meet in its vanishing point, and cameras are seldom rolled. `normals` are of cells of the view, towards
/// the camera, zero where unknown. A plane that lies across the direction tells it exactly. Without edges as above.
std::optional<Vertical> vertical_from_planes(const PointGrid& grid, std::span<const Model> planes, const ImageEdges& edges,
                                             std::span<const Eigen::Vector3f> normals, double horizontal_angle);

/// Whether further planes, of `left` inliers in all, leave that vertical as it is: one that an upright camera could see as a floor or a
/// table outweighs whatever is not of its direction.
bool is_vertical_decided(const PointGrid& grid, std::span<const Model> planes, std::size_t left, double horizontal_angle);

}  // namespace swarmfit::perception
