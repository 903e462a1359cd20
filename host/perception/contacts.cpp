#include "host/perception/contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace swarmfit::perception {
namespace {

constexpr int kInside = 4;                  // [cells] from the border to where a patch's own normal is read
constexpr double kFlat = 0.26;              // [rad] patches that meet at less go on in one another
constexpr double kCrease = 0.52;            // [rad] a concave edge that counts in full
constexpr double kCreaseWeight = 2.5;       // against 1 of a convex edge: two things touch along short borders;
constexpr double kRoughCreaseWeight = 1.5;  // where normals are unsteady there are creases that are none
constexpr float kUnbroken = 4;              // footprints between neighbouring cells of one surface at most
constexpr double kRim = 30;                 // [rad / m] convex, and bent more than this
constexpr double kStepWeight = 1;
constexpr double kStepSigmas = 4;
constexpr double kLeastContact = 0.25;  // of the root of the smaller one's cells, where normals are steady
constexpr int kReach = 6;               // [cells] holes between patches may be this wide
constexpr float kNear = 0.035f;         // [m] patches this near are neighbours, though they say nothing of each other

/// The place at most `most` cells inside the patch at (u, v), in the direction (du, dv).
std::size_t step_inside(const CoarseGrid& coarse, const Patches& patches, int u, int v, int du, int dv, int most) {
  const auto start = static_cast<std::size_t>(v * coarse.width + u);
  std::size_t inside = start;
  for (int k = 1; k <= most; ++k) {
    const int x = u + k * du, y = v + k * dv;
    if (x < 0 || y < 0 || x >= coarse.width || y >= coarse.height) break;
    const auto at = static_cast<std::size_t>(y * coarse.width + x);
    if (patches.label[at] != patches.label[start]) break;
    inside = at;
  }
  return inside;
}

/// The place `steps` cells on from `start`, if the surface goes on so far without a break.
std::size_t follow_surface(const PointGrid& grid, const CoarseGrid& coarse, std::size_t start, int du, int dv, int steps) {
  int x = static_cast<int>(start) % coarse.width, y = static_cast<int>(start) / coarse.width;
  std::size_t at = start;
  for (int k = 1; k <= steps; ++k) {
    x += du;
    y += dv;
    if (x < 0 || y < 0 || x >= coarse.width || y >= coarse.height) break;
    const auto to = static_cast<std::size_t>(y * coarse.width + x);
    const float reach = kUnbroken * coarse.footprint(at, grid.pitch);
    if (coarse.group[to] != coarse.group[start] || (coarse.points[to] - coarse.points[at]).squaredNorm() > reach * reach) break;
    at = to;
  }
  return at;
}

/// Unit normal of a cell, or its patch's where the cell has none.
const Eigen::Vector3f& normal_at(const CoarseGrid& coarse, const Patches& patches, std::size_t at) {
  return coarse.normals[at].squaredNorm() > 0 ? coarse.normals[at] : patches.list[patches.label[at] - 1u].normal;
}

double angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::acos(std::clamp(static_cast<double>(a.dot(b)), -1.0, 1.0));
}

/// Curvature of a patch between two of its cells [rad / m], of a hollow > 0.
double hollowness(const CoarseGrid& coarse, const Patches& patches, std::size_t a, std::size_t b) {
  if (a == b) return 0;
  const Eigen::Vector3f &na = normal_at(coarse, patches, a), &nb = normal_at(coarse, patches, b);
  const Eigen::Vector3f d = coarse.points[a] - coarse.points[b];
  const double curvature = angle_between(na, nb) / std::max(1e-6, static_cast<double>(d.norm()));
  return (na - nb).dot(d) > 0 ? -curvature : curvature;
}

struct Border {
  int u, v, x, y;  // a cell of one patch, and a cell of the other across at most kReach cells
};

double vote(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const Border& border, double noise) {
  const auto sign = [](int k) { return (k > 0) - (k < 0); };
  const int du = sign(border.x - border.u), dv = sign(border.y - border.v);
  const auto at = static_cast<std::size_t>(border.v * coarse.width + border.u);
  const auto to = static_cast<std::size_t>(border.y * coarse.width + border.x);
  const auto a = step_inside(coarse, patches, border.u, border.v, -du, -dv, kInside);
  const auto b = step_inside(coarse, patches, border.x, border.y, du, dv, kInside);
  const Eigen::Vector3f &na = normal_at(coarse, patches, a), &nb = normal_at(coarse, patches, b);

  // A step: neither patch, prolonged, meets the other's border.
  const Eigen::Vector3f gap = coarse.points[at] - coarse.points[to];
  const double off = static_cast<double>(std::min(std::abs(gap.dot(na)), std::abs(gap.dot(nb))));
  const double sigma = noise * static_cast<double>(coarse.points[at].squaredNorm());
  if (off > kStepSigmas * sigma + static_cast<double>(coarse.footprint(at, grid.pitch))) return -kStepWeight;

  const double angle = angle_between(na, nb);
  const Eigen::Vector3f d = coarse.points[a] - coarse.points[b];
  if (angle < kFlat || (na - nb).dot(d) > 0) return 1;
  // Concave. What both sides bend by anyway is no crease.
  const auto a2 = follow_surface(grid, coarse, a, -du, -dv, kInside);
  const auto b2 = follow_surface(grid, coarse, b, du, dv, kInside);
  double bent = 0, known = 0;
  for (const auto& [from, to_end] : {std::pair{a, a2}, std::pair{b, b2}}) {
    const double hollow = hollowness(coarse, patches, from, to_end);
    if (from == to_end || hollow < -kRim) continue;  // too short, or over a rim: that side does not tell
    bent += std::max(0.0, hollow);
    ++known;
  }
  const double crease = angle - (known > 0 ? bent / known : 0) * static_cast<double>(d.norm());
  return crease < kFlat ? 1 : -by_steadiness(coarse, kCreaseWeight, kRoughCreaseWeight) * std::min(1.0, crease / kCrease);
}

}  // namespace

Contacts measure_contacts(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const GroupingOptions& options) {
  constexpr std::array<std::array<int, 2>, 4> kForward{{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};
  Contacts contacts;
  const auto meet = [&](std::size_t at, const Border& border) {
    const auto to = static_cast<std::size_t>(border.y * coarse.width + border.x);
    const float distance = (coarse.points[to] - coarse.points[at]).norm();
    const float step = std::max(static_cast<float>(options.flood_step), 3 * coarse.footprint(at, grid.pitch));
    if (distance > std::max(step, kNear)) return;
    auto& contact = contacts[std::minmax(patches.label[at] - 1, patches.label[to] - 1)];
    contact.length += 1;
    const bool adjacent = std::max(std::abs(border.x - border.u), std::abs(border.y - border.v)) <= kReach / 2;
    if (adjacent && distance <= step && coarse.group[to] == coarse.group[at])
      contact.weight += vote(grid, coarse, patches, border, options.noise);
  };
  for (int v = 0; v < coarse.height; ++v)
    for (int u = 0; u < coarse.width; ++u) {
      const auto at = static_cast<std::size_t>(v * coarse.width + u);
      if (patches.label[at] == 0) continue;
      for (const auto& [du, dv] : kForward)
        for (int reach = 1; reach <= kReach; ++reach) {
          const int x = u + reach * du, y = v + reach * dv;
          if (x < 0 || y < 0 || x >= coarse.width || y >= coarse.height) break;
          const auto to = static_cast<std::size_t>(y * coarse.width + x);
          if (patches.label[to] == 0) continue;  // a hole: look across it
          if (patches.label[to] != patches.label[at]) meet(at, {u, v, x, y});
          break;
        }
    }
  return contacts;
}

std::vector<int> contract(const CoarseGrid& coarse, const Patches& patches, Contacts contacts) {
  const double least = by_steadiness(coarse, kLeastContact, 0);
  std::vector<int> parent(patches.list.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<double> cells;  // of each cluster, at its lowest patch
  for (const Patch& patch : patches.list) cells.push_back(static_cast<double>(patch.cells));
  const auto merely_touch = [&](const std::pair<int, int>& pair, double weight) {
    const auto [one, other] = std::pair(cells[static_cast<std::size_t>(pair.first)], cells[static_cast<std::size_t>(pair.second)]);
    return weight <= least * std::sqrt(std::min(one, other));
  };
  while (true) {
    auto best = contacts.end();
    double most = 0;
    for (auto it = contacts.begin(); it != contacts.end(); ++it) {
      if (it->second.weight <= most || merely_touch(it->first, it->second.weight)) continue;
      most = it->second.weight;
      best = it;
    }
    if (best == contacts.end()) return parent;
    const auto [keep, gone] = best->first;
    contacts.erase(best);
    cells[static_cast<std::size_t>(keep)] += cells[static_cast<std::size_t>(gone)];
    for (auto& p : parent)
      if (p == gone) p = keep;
    // The contacts of the one that is gone become those of the one that stays.
    std::vector<std::pair<std::pair<int, int>, Contact>> moved;
    for (auto it = contacts.begin(); it != contacts.end();) {
      const auto pair = it->first;
      if (pair.first != gone && pair.second != gone) {
        ++it;
        continue;
      }
      moved.emplace_back(std::minmax(keep, pair.first == gone ? pair.second : pair.first), it->second);
      it = contacts.erase(it);
    }
    for (const auto& [pair, contact] : moved) {
      contacts[pair].weight += contact.weight;
      contacts[pair].length += contact.length;
    }
  }
}

}  // namespace swarmfit::perception
