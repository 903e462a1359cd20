#include "host/perception/vertical.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
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
constexpr double kSpread = 0.1;     // [rad] of the normals of what is level or upright
constexpr double kWallShare = 0.3;  // of a level surface's weight: a wall tells one of two angles, and much is upright by chance
constexpr double kLevel = 0.14;     // [rad] a plane this near tells the vertical better than walls and edges do
constexpr double kRoll = 0.14;      // [rad] standard deviation of how cameras are rolled
constexpr double kNearlyAll = 0.9;  // of the cells
constexpr double kBins = 8;         // to a unit: normals are put together where they are alike to 7 degrees
constexpr double kMostRoll = 0.52, kMostUpwards = 0.8, kMostDownwards = 1.57;  // [rad] what is tried
constexpr double kCoarseStep = 0.035, kFineStep = 0.009;                       // [rad]
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

double bell(double angle, double spread) { return std::exp(-0.5 * (angle / spread) * (angle / spread)); }

/// How well a direction would do as the vertical.
class Uprightness {
 public:
  Uprightness(std::span<const Eigen::Vector3f> normals, const ImageEdges& edges, const ImageAxes& axes);

  double operator()(const Eigen::Vector3d& up) const {
    double score = edges_.share_along(up);
    for (const Facet& facet : facets_) {
      const double cosine = std::abs(facet.normal.dot(up));
      score += facet.as_level * std::exp((cosine - 1) / (kSpread * kSpread)) + kWallShare * facet.share * bell(cosine, kSpread);
    }
    return score * bell(std::asin(std::clamp(up.dot(axes_.right), -1.0, 1.0)), kRoll);
  }

  /// The best direction of all that a camera might have, to kFineStep.
  Eigen::Vector3d best() const {
    const Tilt coarse = search({-kMostUpwards, -kMostRoll}, {kMostDownwards, kMostRoll}, kCoarseStep);
    const Tilt fine =
        search({coarse.pitch - kCoarseStep, coarse.roll - kCoarseStep}, {coarse.pitch + kCoarseStep, coarse.roll + kCoarseStep}, kFineStep);
    return direction(fine);
  }

 private:
  struct Facet {
    Eigen::Vector3d normal;  // towards the camera
    double share, as_level;  // of all cells; the same, by how likely a camera sees a level surface like that
  };
  struct Tilt {
    double pitch, roll;  // [rad] of the camera, downwards and to the right
  };

  Tilt search(const Tilt& first, const Tilt& last, double step) const {
    Tilt best = first;
    double most = -1;
    for (double pitch = first.pitch; pitch <= last.pitch; pitch += step)
      for (double roll = first.roll; roll <= last.roll; roll += step)
        if (const double score = (*this)(direction({pitch, roll})); score > most) {
          most = score;
          best = {pitch, roll};
        }
    return best;
  }

  Eigen::Vector3d direction(const Tilt& tilt) const {
    const Eigen::Vector3d forward = axes_.right.cross(axes_.down),
                          across = std::sin(tilt.roll) * axes_.right - std::cos(tilt.roll) * axes_.down;
    return (std::cos(tilt.pitch) * across - std::sin(tilt.pitch) * forward).normalized();
  }

  const ImageEdges& edges_;
  ImageAxes axes_;
  std::vector<Facet> facets_;
};

Uprightness::Uprightness(std::span<const Eigen::Vector3f> normals, const ImageEdges& edges, const ImageAxes& axes)
    : edges_(edges), axes_(axes) {
  std::map<std::array<long, 3>, std::pair<Eigen::Vector3d, double>> bins;  // sum of normals, and how many
  double cells = 0;
  for (const auto& normal : normals) {
    if (normal.squaredNorm() == 0) continue;
    const std::array<long, 3> key{std::lround(normal.x() * kBins), std::lround(normal.y() * kBins), std::lround(normal.z() * kBins)};
    auto& [total, count] = bins.try_emplace(key, Eigen::Vector3d::Zero(), 0.0).first->second;
    total += normal.cast<double>();
    ++count;
    ++cells;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [key, bin] : bins) sum += bin.first;
  double alike = 0;
  for (const auto& [key, bin] : bins)
    if (bin.first.normalized().dot(sum.normalized()) > std::cos(kLeans)) alike += bin.second;
  // Seen from straight above, tables and the things on them are parallel; walls and fronts are not.
  const bool from_above = alike > kNearlyAll * cells;
  for (const auto& [key, bin] : bins) {
    const Eigen::Vector3d normal = bin.first.normalized();
    const double share = bin.second / cells;
    facets_.push_back({normal, share, share * (from_above ? 1 : plausibility(normal, axes))});
  }
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

std::optional<Vertical> vertical_from_planes(const PointGrid& grid, std::span<const Model> planes, const ImageEdges& edges,
                                             std::span<const Eigen::Vector3f> normals, double horizontal_angle) {
  const auto axes = image_axes(grid);
  if (edges.list.empty() || normals.empty() || !axes) return vertical_from_planes(grid, planes, horizontal_angle);
  const Eigen::Vector3d up = Uprightness(normals, edges, *axes).best();
  const Model* level = nullptr;
  for (const auto& plane : planes)
    if (std::abs(plane.normal().dot(up)) > std::cos(kLevel) && (level == nullptr || plane.inliers > level->inliers)) level = &plane;
  if (level == nullptr) return Vertical{up, kFromEdges};
  return Vertical{level->normal().dot(up) > 0 ? level->normal() : Eigen::Vector3d(-level->normal()), kFromDominantPlane};
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
