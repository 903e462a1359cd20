#include "host/perception/stereo_planes.hpp"

#include <cmath>

namespace swarmfit::perception {
namespace {

constexpr float kAlong = 0.9f;         // cosine: a cell whose normal is farther off does not lie in the plane
constexpr double kAboveChance = 0.15;  // of cells of known direction; of any directions 1 - kAlong would
constexpr std::size_t kFewCells = 50;  // do not tell a plane better than the swarm does
constexpr int kRounds = 4;

std::vector<std::uint32_t> known_members(const Overview& overview, std::span<const std::uint32_t> chosen, const LocalPlane& plane,
                                         float tau) {
  std::vector<std::uint32_t> members;
  for (const auto i : chosen)
    if (overview.knows_normal(i) && std::abs(plane.height(overview.cells.points[i])) <= tau && overview.agrees(i, plane.normal, kAlong))
      members.push_back(i);
  return members;
}

}  // namespace

LocalPlane refine_on_known(const Overview& overview, std::span<const std::uint32_t> chosen, const LocalPlane& plane, float tau,
                           const Eigen::Vector3d& up, double most_angle) {
  LocalPlane refined = plane;
  for (int round = 0; round < kRounds; ++round) {
    const auto members = known_members(overview, chosen, refined, tau);
    if (members.size() < kFewCells) break;
    PlaneFit fitted = fit_plane(overview.cells.points, members, up);
    if (fitted.normal.dot(up) < std::cos(most_angle)) fitted.normal = refined.normal.cast<double>();
    refined = fitted.plane();
  }
  return refined;
}

bool lies_along(const Overview& overview, const Surface& surface, float tau) {
  std::size_t known = 0, along = 0;
  for (std::size_t i = 0; i < overview.cells.size(); ++i) {
    const auto& p = overview.cells.points[i];
    if (!overview.knows_normal(i) || std::abs(surface.plane.height(p)) > tau || !surface.on_component(p)) continue;
    ++known;
    along += overview.agrees(i, surface.plane.normal, kAlong) ? 1 : 0;
  }
  return static_cast<double>(along) >= kAboveChance * static_cast<double>(known);
}

}  // namespace swarmfit::perception
