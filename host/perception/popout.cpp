#include "host/perception/popout.hpp"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "host/common/parallel.hpp"

namespace swarmfit::perception {
namespace {

constexpr float kFringeSigmas = 3.0f;  // points this far above the plane are the foot of what stands on it
constexpr float kSeedSigmas = 4.5f;    // a height that the plane's noise does not reach
constexpr int kHole = 3;               // [px] at 640 columns: holes in the depth that the fill may jump
constexpr float kNearCeiling = 0.93f;  // of max_height
constexpr double kCutShare = 0.05;     // of a group's points near max_height: it goes on beyond, so it is a wall and no object
constexpr double kCutLength = 0.3;     // the same where it is seen to go on: its cut edge over the square root of its size [px]
constexpr double kBorderShare = 0.8;   // of a group's points over the edge of the surface
constexpr float kBorderLength = 0.4f;  // [m] shorter things at the edge are things
constexpr int kMostSurfaces = 127;
constexpr int kPointsAtOnce = 16384;  // of a range that one thread works on

/// For the points [first, last) the surface right below each, and the height above it.
void find_floor_below(const PointGrid& grid, std::span<const Surface> surfaces, const PopoutOptions& options, std::size_t first,
                      std::size_t last, std::vector<Standing>& standing) {
  const auto count = std::min<std::size_t>(surfaces.size(), kMostSurfaces);
  const auto least = static_cast<float>(options.min_height), most = static_cast<float>(options.max_height);
  for (std::size_t i = first; i < last; ++i) {
    const auto& p = grid.points[i];
    Standing here;
    float lowest = most;
    const float range2 = p.squaredNorm();
    for (std::size_t s = 0; s < count; ++s) {
      const float h = surfaces[s].plane.height(p);
      if (!(h < lowest)) continue;  // nor where nothing was seen
      // Within the noise of a surface counts as on it, so that a board is not taken for an object on the board below.
      const float fringe = std::min(least, kFringeSigmas * surfaces[s].sigma_at(range2));
      if (h < -fringe || (count == 1 && h <= fringe)) continue;
      if (!surfaces[s].contains(p)) continue;
      lowest = h;
      here.surface = h > fringe ? static_cast<std::uint8_t>(s + 1) : std::uint8_t{0};
    }
    if (here.surface != 0) {
      // Without an image grid there is no range to go by.
      const float noise = grid.organised() ? kSeedSigmas * surfaces[here.surface - 1U].sigma_at(range2) : 0;
      here.sure = lowest >= std::max(least, noise);
    }
    standing[i] = here;
  }
}

/// Grows groups. Who stands next to a member, and joins, is the `Neighbours`' to say.
template <class Neighbours>
class Flood {
 public:
  Flood(const PointGrid& grid, Popout& result) : grid_(grid), result_(result) {}

  bool is_seed(std::size_t i) const { return result_.standing[i].sure != 0; }

  /// Members of the group of `seed`, marked with `mark`.
  const std::vector<std::uint32_t>& grow(std::size_t seed, std::uint16_t mark) {
    members_.clear();
    join(static_cast<std::uint32_t>(seed), mark);
    for (std::size_t next = 0; next < members_.size(); ++next) static_cast<Neighbours*>(this)->spread(members_[next], mark);
    return members_;
  }

 protected:
  void join(std::uint32_t point, std::uint16_t mark) {
    result_.group[point] = mark;
    members_.push_back(point);
  }

  const PointGrid& grid_;
  Popout& result_;

 private:
  std::vector<std::uint32_t> members_;
};

/// Over the image grid. Points below `min_height` join but do not spread.
class GridFlood : public Flood<GridFlood> {
 public:
  GridFlood(const PointGrid& grid, std::span<const Surface> surfaces, const PopoutOptions& options, Popout& result)
      : Flood(grid, result), surfaces_(surfaces), options_(options), hole_(std::max(1, kHole * grid.width / 640)) {}

  void spread(std::size_t at, std::uint16_t mark) {
    if (!is_seed(at)) return;
    const auto width = static_cast<std::uint32_t>(grid_.width);
    const int u = static_cast<int>(static_cast<std::uint32_t>(at) % width), v = static_cast<int>(static_cast<std::uint32_t>(at) / width);
    const auto& p = grid_.points[at];
    const auto& surface = surfaces_[result_.standing[at].surface - 1U];
    const float step = flood_step_at(grid_, surface.noise, options_.flood_step, PointGrid::range(p));
    const std::uint8_t above = result_.standing[at].surface;
    const auto reach = [&](int x, int y, bool across_hole) {
      if (x < 0 || y < 0 || x >= grid_.width || y >= grid_.height) return true;
      const auto to = static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width) + static_cast<std::size_t>(x);
      if (result_.group[to] == mark) return is_seed(to);
      if (result_.standing[to].surface != above || result_.group[to] != 0) return false;
      if ((grid_.points[to] - p).squaredNorm() > step * step || (across_hole && !is_seed(to))) return false;
      join(static_cast<std::uint32_t>(to), mark);
      return is_seed(to);
    };
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du) {
        if (du == 0 && dv == 0) continue;
        // What spreads from the neighbour in that direction need not be jumped to.
        if (!reach(u + du, v + dv, false)) reach(u + du * (hole_ + 1), v + dv * (hole_ + 1), true);
      }
  }

 private:
  std::span<const Surface> surfaces_;
  const PopoutOptions& options_;
  int hole_;  // [px]
};

/// Without an image grid: neighbours come from a hash of voxels one step wide.
class VoxelFlood : public Flood<VoxelFlood> {
 public:
  VoxelFlood(const PointGrid& grid, const PopoutOptions& options, Popout& result)
      : Flood(grid, result), step_(static_cast<float>(options.flood_step)) {
    for (std::size_t i = 0; i < grid.size(); ++i)
      if (is_seed(i)) voxels_[key(cell(grid.points[i]))].push_back(static_cast<std::uint32_t>(i));
  }

  void spread(std::size_t at, std::uint16_t mark) {
    const auto& p = grid_.points[at];
    const Eigen::Vector3i c = cell(p);
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) visit(p, c + Eigen::Vector3i(dx, dy, dz), at, mark);
  }

 private:
  void visit(const Eigen::Vector3f& p, const Eigen::Vector3i& at_cell, std::size_t at, std::uint16_t mark) {
    const auto found = voxels_.find(key(at_cell));
    if (found == voxels_.end()) return;
    auto& points = found->second;
    // What has been reached leaves the voxel, so that each is looked at a bounded number of times.
    std::size_t kept = 0;
    for (const auto to : points) {
      if (result_.group[to] != 0) continue;
      if (result_.standing[to].surface == result_.standing[at].surface && (grid_.points[to] - p).squaredNorm() <= step_ * step_) {
        join(to, mark);
        continue;
      }
      points[kept++] = to;
    }
    points.resize(kept);
  }
  Eigen::Vector3i cell(const Eigen::Vector3f& p) const { return (p / step_).array().floor().max(-1e6f).min(1e6f).cast<int>(); }
  static std::uint64_t key(const Eigen::Vector3i& c) {
    const auto part = [](int v) { return static_cast<std::uint64_t>(v + 1048576) & 0x1fffffu; };
    return part(c.x()) << 42 | part(c.y()) << 21 | part(c.z());
  }

  float step_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> voxels_;
};

/// Along the edge of the surface, and long: the wall behind a table, its rim, a bench beside it.
bool is_border(const PointGrid& grid, const Surface& surface, const std::vector<std::uint32_t>& members) {
  std::size_t at_edge = 0;
  Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const auto i : members) {
    const auto& p = grid.points[i];
    at_edge += surface.at_edge(p) ? 1 : 0;
    const Eigen::Vector2f q(surface.axis_a.dot(p), surface.axis_b.dot(p));
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  return (high - low).norm() > kBorderLength && static_cast<double>(at_edge) > kBorderShare * static_cast<double>(members.size());
}

/// A thing that is cut off at max_height goes on above it: a wall, a curtain, a person.
bool is_structure(const PointGrid& grid, const Surface& surface, const std::vector<std::uint32_t>& members, const PopoutOptions& options) {
  const auto ceiling = static_cast<float>(options.max_height);
  if (!grid.organised()) {
    const auto high = std::count_if(members.begin(), members.end(),
                                    [&](std::uint32_t i) { return surface.plane.height(grid.points[i]) > kNearCeiling * ceiling; });
    return static_cast<double>(high) > kCutShare * static_cast<double>(members.size());
  }
  std::size_t cut = 0;
  const auto width = static_cast<std::size_t>(grid.width);
  for (const std::size_t i : members) {
    if (surface.plane.height(grid.points[i]) < kNearCeiling * ceiling) continue;
    const float step = flood_step_at(grid, surface.noise, options.flood_step, PointGrid::range(grid.points[i]));
    const auto goes_on = [&](std::size_t to) {
      return to < grid.size() && surface.plane.height(grid.points[to]) >= ceiling &&
             (grid.points[to] - grid.points[i]).squaredNorm() <= step * step;
    };
    cut += goes_on(i - width) || goes_on(i + width) || goes_on(i - 1) || goes_on(i + 1) ? 1 : 0;
  }
  return static_cast<double>(cut) > kCutLength * std::sqrt(static_cast<double>(members.size()));
}

template <class Flood>
void collect(Flood&& flood, const PointGrid& grid, std::span<const Surface> surfaces, const PopoutOptions& options, Popout& result) {
  constexpr std::uint16_t kDropped = 65535;
  for (std::size_t seed = 0; seed < grid.size() && result.size.size() + 1 < kDropped; ++seed) {
    if (result.group[seed] != 0 || !flood.is_seed(seed)) continue;
    const auto mark = static_cast<std::uint16_t>(result.size.size() + 1);
    const auto& members = flood.grow(seed, mark);
    const auto& surface = surfaces[result.standing[seed].surface - 1U];
    if (members.size() >= options.min_points && !is_structure(grid, surface, members, options) && !is_border(grid, surface, members)) {
      result.size.push_back(members.size());
      result.support.push_back(result.standing[seed].surface - 1);
    } else {
      for (const auto i : members) result.group[i] = kDropped;
    }
  }
  for (auto& g : result.group)
    if (g == kDropped) g = 0;
}

}  // namespace

float flood_step_at(const PointGrid& grid, double noise, double flood_step, float range) {
  const float sampling = 3 * grid.pitch * range, jitter = 6 * static_cast<float>(noise) * range * range;
  return std::max({static_cast<float>(flood_step), sampling, jitter});
}

Popout pop_out(const PointGrid& grid, std::span<const Surface> surfaces, const PopoutOptions& options) {
  Popout result;
  result.group.assign(grid.size(), 0);
  result.standing.resize(grid.size());
  common::in_parallel(static_cast<int>(grid.size()), kPointsAtOnce, options.threads, [&](int first, int last) {
    find_floor_below(grid, surfaces, options, static_cast<std::size_t>(first), static_cast<std::size_t>(last), result.standing);
  });
  if (grid.organised())
    collect(GridFlood(grid, surfaces, options, result), grid, surfaces, options, result);
  else
    collect(VoxelFlood(grid, options, result), grid, surfaces, options, result);
  return result;
}

}  // namespace swarmfit::perception
