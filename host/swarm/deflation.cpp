#include "host/swarm/deflation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kFurthest = Support::kSlabs - 2;  // slabs that a tail may fill
constexpr double kTailShare = 0.12;                     // of what the model's own slab holds above the next one
constexpr double kDeviations = 3;                       // a fall, or a lack, that chance would not make

constexpr double kPerCell = 24;      // points near a plane in a cell of it, about
constexpr double kOwn = 0.3;         // for each of a cell's points beside the plane: where it has fewer of its own, these are no tail of it
constexpr std::uint32_t kLeast = 6;  // points beside it that tell something

/// Where a point near a plane stands on it [working frame].
struct Footprint {
  std::uint32_t point;
  float x, y;
};

/// Of the unexplained points within reach.
kernels::Reused<Footprint> footprints(const models::WorkingPoints& points, const Eigen::Vector3d& normal, std::span<const float> distances,
                                      std::span<const float> caps, float tau, int reach) {
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  const float far = static_cast<float>(reach) * tau, least = kUnexplained * tau;
  kernels::Reused<Footprint> near;
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (!(distances[i] < far) || caps[i] < least) continue;
    const Eigen::Vector3d p = points.point<3>(i);
    near.push_back({static_cast<std::uint32_t>(i), static_cast<float>(p.dot(u)), static_cast<float>(p.dot(v))});
  }
  return near;
}

/// A plane in square cells, of such a size that its points would fill a rectangle with kPerCell in each.
class PlaneCells {
 public:
  struct Cell {
    std::uint32_t own = 0, beside = 0;
  };

  explicit PlaneCells(std::span<const Footprint> near) : cells_(static_cast<std::size_t>(kAcross) * kAcross) {
    const auto n = static_cast<double>(near.size());
    double xx = 0, yy = 0, xy = 0;
    for (const Footprint& one : near) {
      x_ += static_cast<double>(one.x) / n;
      y_ += static_cast<double>(one.y) / n;
    }
    for (const Footprint& one : near) {
      const double x = static_cast<double>(one.x) - x_, y = static_cast<double>(one.y) - y_;
      xx += x * x / n;
      yy += y * y / n;
      xy += x * y / n;
    }
    const double area = 12 * std::sqrt(std::max(0.0, xx * yy - xy * xy));
    // Six standard deviations across; what is beyond goes to the cells on the rim.
    const double least = std::max(6 * std::sqrt(std::max(xx, yy)) / kAcross, 1e-9);
    width_ = std::max(std::sqrt(area * kPerCell / n), least);
  }

  Cell& at(const Footprint& one) {
    const auto place = [&](float along, double middle) {
      return std::clamp(static_cast<int>(std::floor((static_cast<double>(along) - middle) / width_)) + kAcross / 2, 0, kAcross - 1);
    };
    return cells_[static_cast<std::size_t>(place(one.y, y_) * kAcross + place(one.x, x_))];
  }

 private:
  static constexpr int kAcross = 64;
  kernels::Reused<Cell> cells_;
  double x_ = 0, y_ = 0, width_ = 1;
};

/// Are the points beside a plane in this cell another surface? `share`: of all points near the plane, those that are its own.
bool is_another(const PlaneCells::Cell& cell, double share) {
  if (cell.beside < kLeast) return false;
  const double own = cell.own, n = own + cell.beside;
  return own < kOwn * cell.beside && own < share * n - kDeviations * std::sqrt(share * (1 - share) * n);
}

}  // namespace

int tail_reach(const Support& support) {
  std::array<double, Support::kSlabs> slab;
  std::transform(support.slabs.begin(), support.slabs.end(), slab.begin(), [](std::size_t n) { return static_cast<double>(n); });
  // A tail falls from slab to slab until it meets the surroundings, which stay level.
  int reach = 1;
  for (std::size_t k = 1; k <= kFurthest; ++k) {
    const double fall = slab[k] - slab[k + 1];
    const bool tail = fall > kTailShare * (slab[0] - slab[k + 1]) && fall > kDeviations * std::sqrt(slab[k] + slab[k + 1]);
    if (!tail) break;
    ++reach;
  }
  return reach;
}

kernels::Reused<float> local_reach(const models::WorkingPoints& points, const Eigen::Vector3d& normal, std::span<const float> distances,
                                   std::span<const float> caps, float tau, int reach) {
  kernels::Reused<float> reaches(caps.size(), static_cast<float>(reach));
  const kernels::Reused<Footprint> near = footprints(points, normal, distances, caps, tau, reach);
  if (static_cast<double>(near.size()) < kPerCell) return reaches;
  PlaneCells cells(near);
  double own = 0;
  for (const Footprint& one : near) {
    const bool mine = distances[one.point] < tau;
    PlaneCells::Cell& there = cells.at(one);
    ++(mine ? there.own : there.beside);
    own += mine ? 1 : 0;
  }
  const double share = own / static_cast<double>(near.size());
  for (const Footprint& one : near) {
    if (is_another(cells.at(one), share)) reaches[one.point] = 1;
  }
  return reaches;
}

void deflate(std::span<const float> distances, const DeadZone& zone, std::size_t first, std::span<float> caps, Near& near) {
  const auto here = [&]<class T>(std::span<T> all) { return all.empty() ? all : all.subspan(first, distances.size()); };
  kernels::Sinking how;
  how.width = zone.tau;
  how.widths = here(zone.allowed);
  how.reach = static_cast<float>(zone.reach);
  how.reaches = here(std::span<const float>(zone.reaches));
  how.slope = static_cast<float>(zone.slope);
  how.marked = static_cast<float>(Support::kSlabs);
  kernels::sink(distances, how, here(std::span(near.beside)), here(std::span(near.nearest)), here(caps));
}

}  // namespace swarmfit::swarm
