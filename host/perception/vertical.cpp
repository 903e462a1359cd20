#include "host/perception/vertical.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

namespace swarmfit::perception {
namespace {

constexpr double kRises = 0.3;       // a plane whose normal leans this far to the image's top is seen from above: a floor or a table
constexpr double kWallWeight = 0.2;  // one that faces the camera may be a wall as well as a table seen from straight above
constexpr double kCeilingWeight = 0.02;
constexpr double kLeans = 0.35;      // across the image; cameras are seldom rolled
constexpr double kParallel = 0.995;  // cosine of 6 degrees
constexpr double kLeanWeight = 0.2;
constexpr int kLooks = 64;  // at most about so many rays a row tell where the image's bottom is

/// Where the image's right and its bottom lie in the cloud's frame; empty without an image grid.
struct ImageAxes {
  Eigen::Vector3d right, down;
};

std::optional<ImageAxes> image_axes(const PointGrid& grid) {
  if (!grid.organised()) return std::nullopt;
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), down = Eigen::Vector3d::Zero();
  const int du = std::max(1, grid.width / 16), dv = std::max(1, grid.height / 16);
  const auto ray = [&](int u, int v) -> Eigen::Vector3d {
    return grid.points[static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u)]
        .cast<double>()
        .normalized();
  };
  const int step = std::max(1, grid.width / kLooks);
  for (int v = 0; v + dv < grid.height; v += step)
    for (int u = 0; u + du < grid.width; u += step) {
      const Eigen::Vector3d here = ray(u, v), beside = ray(u + du, v), below = ray(u, v + dv);
      if (beside.allFinite() && here.allFinite()) right += beside - here;
      if (below.allFinite() && here.allFinite()) down += below - here;
    }
  if (right.norm() < 1e-9 || down.norm() < 1e-9) return std::nullopt;
  return ImageAxes{right.normalized(), down.normalized()};
}

/// Normal towards the camera.
Eigen::Vector3d facing(const PointGrid& grid, const Model& plane) {
  const double at_camera = plane.offset() + (grid.organised() ? 0.0 : plane.normal().dot(Eigen::Vector3d::Zero()));
  return at_camera >= 0 ? plane.normal() : Eigen::Vector3d(-plane.normal());
}

double plausibility(const Eigen::Vector3d& normal, const std::optional<ImageAxes>& axes) {
  if (!axes) return 1;
  const double rise = -normal.dot(axes->down), lean = std::abs(normal.dot(axes->right));
  const double weight = rise > kRises ? 1 : rise > -kRises ? kWallWeight : kCeilingWeight;
  return lean < kLeans ? weight : weight * kLeanWeight;
}

struct Weighed {
  std::vector<Eigen::Vector3d> normals;  // towards the camera
  std::vector<double> weights;
};

Weighed weigh(const PointGrid& grid, std::span<const Model> planes, const std::optional<ImageAxes>& axes) {
  Weighed out;
  for (const auto& plane : planes) {
    out.normals.push_back(facing(grid, plane));
    out.weights.push_back(static_cast<double>(plane.inliers) * plausibility(out.normals.back(), axes));
  }
  return out;
}

}  // namespace

Vertical vertical_from_gravity(const Eigen::Vector3d& gravity) { return {-gravity.normalized(), "gravity"}; }

Vertical vertical_from_tilt(double tilt) { return {Eigen::Vector3d(0, -std::cos(tilt), -std::sin(tilt)), "camera tilt"}; }

std::optional<Vertical> vertical_from_planes(const PointGrid& grid, std::span<const Model> planes, double horizontal_angle) {
  if (planes.empty()) return std::nullopt;
  const auto axes = image_axes(grid);
  const auto [normals, weights] = weigh(grid, planes, axes);
  const auto alike = [&](std::size_t i, std::size_t j) { return std::abs(normals[i].dot(normals[j])) > std::cos(horizontal_angle); };
  std::size_t centre = 0;
  double most = -1;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    double shared = 0;
    for (std::size_t j = 0; j < normals.size(); ++j)
      if (alike(i, j)) shared += weights[j];
    if (shared > most) {
      most = shared;
      centre = i;
    }
  }
  // Of the planes of one direction, the largest tells it best; a small one amid them has most of them about it.
  std::size_t best = centre;
  for (std::size_t j = 0; j < normals.size(); ++j)
    if (alike(centre, j) && weights[j] > weights[best]) best = j;
  const Eigen::Vector3d normal = normals[best];
  if (axes && std::abs(normal.dot(axes->down)) < kRises) {
    const bool sideways = std::abs(normal.dot(axes->right)) >= kLeans;
    // Seen from straight above, tables and the things on them are parallel; walls and fronts are not.
    bool only_walls = true, parallel = true;
    for (const auto& other : normals) {
      only_walls = only_walls && std::abs(other.dot(axes->down)) < 0.5;
      parallel = parallel && std::abs(other.dot(normal)) > kParallel;
    }
    if (sideways || (only_walls && !parallel)) {
      const Eigen::Vector3d up = -axes->down + normal * normal.dot(axes->down);
      return Vertical{up.normalized(), kFromWall};
    }
  }
  return Vertical{normal, kFromDominantPlane};
}

bool is_vertical_decided(const PointGrid& grid, std::span<const Model> planes, std::size_t left, double horizontal_angle) {
  const auto axes = image_axes(grid);
  if (planes.empty() || !axes) return false;
  const auto [normals, weights] = weigh(grid, planes, axes);
  const auto most = static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin());
  // What only may be a floor is judged by the planes beside it.
  if (plausibility(normals[most], axes) < 1) return false;
  auto against = static_cast<double>(left);
  for (std::size_t j = 0; j < normals.size(); ++j)
    if (std::abs(normals[most].dot(normals[j])) <= std::cos(horizontal_angle)) against += weights[j];
  return weights[most] > against;
}

}  // namespace swarmfit::perception
