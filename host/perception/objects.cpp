#include "host/perception/objects.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>

#include "host/common/parallel.hpp"
#include "host/perception/runs.hpp"

namespace swarmfit::perception {
namespace {

constexpr double kIslandShare = 0.9;  // of an island's border that one object holds
constexpr int kIslandReach = 5;       // [cells] holes between an island and what encloses it
constexpr int kIslandCells = 12;      // smaller ones are noise
constexpr int kRowsAtOnce = 16;       // that one thread works on

/// Which object each cell belongs to, and where that is clear for all of its points.
struct CellObjects {
  std::vector<std::uint16_t> object;
  std::vector<std::uint8_t> settled;  ///< 1 where no other object and no other group lies around
};

CellObjects objects_of_cells(const CoarseGrid& coarse, const Patches& patches, const Objects& objects) {
  CellObjects cells;
  cells.object.assign(patches.label.size(), 0);
  for (std::size_t at = 0; at < cells.object.size(); ++at)
    if (patches.label[at] != 0) cells.object[at] = static_cast<std::uint16_t>(objects.of_patch[patches.label[at] - 1u] + 1);
  cells.settled.assign(cells.object.size(), 0);
  for (int v = 1; v + 1 < coarse.height; ++v)
    for (int u = 1; u + 1 < coarse.width; ++u) {
      const auto at = static_cast<std::size_t>(v * coarse.width + u), width = static_cast<std::size_t>(coarse.width);
      bool same = cells.object[at] != 0;
      for (const std::size_t row : {at - width, at, at + width})
        for (const std::size_t to : {row - 1, row, row + 1}) same = same && cells.object[to] == cells.object[at];
      cells.settled[at] = same;
    }
  return cells;
}

/// Object of the nearest cell around the point's own, in space; among cells of the point's group.
std::uint16_t nearest_object(const CoarseGrid& coarse, const CellObjects& cells, const Eigen::Vector3f& p, std::uint16_t group, int cu,
                             int cv) {
  const auto own = static_cast<std::size_t>(cv * coarse.width + cu);
  if (cells.settled[own] != 0 && coarse.group[own] == group) return cells.object[own];
  float nearest = std::numeric_limits<float>::max();
  std::uint16_t found = 0;
  for (int v = std::max(0, cv - 1); v <= std::min(coarse.height - 1, cv + 1); ++v)
    for (int u = std::max(0, cu - 1); u <= std::min(coarse.width - 1, cu + 1); ++u) {
      const auto at = static_cast<std::size_t>(v * coarse.width + u);
      if (cells.object[at] == 0 || coarse.group[at] != group) continue;
      const float distance = (coarse.points[at] - p).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      found = cells.object[at];
    }
  return found;
}

/// Ritter's bounding sphere: at most a few percent larger than the least one.
void bounding_sphere(const PointGrid& grid, const std::vector<std::uint32_t>& members, SpaceOfInterest& soi) {
  const auto farthest = [&](const Eigen::Vector3f& from) {
    std::size_t best = members.front();
    for (const auto i : members)
      if ((grid.points[i] - from).squaredNorm() > (grid.points[best] - from).squaredNorm()) best = i;
    return grid.points[best];
  };
  const Eigen::Vector3f a = farthest(grid.points[members.front()]), b = farthest(a);
  Eigen::Vector3d centre = (a + b).cast<double>() / 2;
  double radius = static_cast<double>((a - b).norm()) / 2;
  for (const auto i : members) {
    const Eigen::Vector3d d = grid.points[i].cast<double>() - centre;
    const double distance = d.norm();
    if (distance <= radius) continue;
    const double grown = (radius + distance) / 2;
    centre += d * ((grown - radius) / distance);
    radius = grown;
  }
  soi.centre = centre + grid.origin;
  soi.radius = radius;
}

std::array<int, 4> bounding_box(const PointGrid& grid, const std::vector<std::uint32_t>& members) {
  const auto width = static_cast<std::uint32_t>(grid.width);
  int low_u = grid.width, high_u = -1, low_v = grid.height, high_v = -1;
  for (const auto i : members) {
    const int u = static_cast<int>(i % width), v = static_cast<int>(i / width);
    low_u = std::min(low_u, u);
    high_u = std::max(high_u, u);
    low_v = std::min(low_v, v);
    high_v = std::max(high_v, v);
  }
  return {low_u, low_v, high_u - low_u + 1, high_v - low_v + 1};
}

/// A frame seen through every stride-th pixel: which object, and what is support.
struct Thumbnail {
  int stride = 1, width = 0, height = 0;
  std::vector<std::uint16_t> object;
  std::vector<std::uint8_t> support;
};

Thumbnail shrink(const PointGrid& grid, std::span<const std::uint16_t> planes, std::span<const std::uint8_t> supporting, int threads,
                 const ObjectLabels& objects) {
  Thumbnail thumb;
  thumb.stride = std::max(1, grid.width / 320);
  thumb.width = grid.width / thumb.stride;
  thumb.height = grid.height / thumb.stride;
  thumb.object.resize(static_cast<std::size_t>(thumb.width) * static_cast<std::size_t>(thumb.height));
  thumb.support.resize(thumb.object.size());
  common::in_parallel(thumb.height, kRowsAtOnce, threads, [&](int first, int last) {
    auto at = static_cast<std::size_t>(first) * static_cast<std::size_t>(thumb.width);
    for (int v = first; v < last; ++v)
      for (int u = 0; u < thumb.width; ++u, ++at) {
        const auto i =
            static_cast<std::size_t>(v * thumb.stride) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u * thumb.stride);
        thumb.object[at] = objects.of_point[i];
        thumb.support[at] = objects.of_point[i] == 0 && supporting[planes[i]] != 0;
      }
  });
  return thumb;
}

/// A stretch of support in one row, [first, last), and the island it belongs to.
struct Run {
  int row, first, last, island;
};

/// Islands of support: runs that touch in neighbouring rows. `size[k]`: cells of the k-th island.
std::vector<Run> find_islands(const Thumbnail& thumb, std::vector<int>& size) {
  std::vector<Run> runs;
  std::vector<int> parent;
  const auto root = [&](int k) {
    while (parent[static_cast<std::size_t>(k)] != k) k = parent[static_cast<std::size_t>(k)];
    return k;
  };
  std::size_t above = 0, row_start = 0;  // first run of the row above that may still touch, and of this row
  for (int v = 0; v < thumb.height; ++v) {
    above = row_start;
    row_start = runs.size();
    const std::uint8_t* support = &thumb.support[static_cast<std::size_t>(v) * static_cast<std::size_t>(thumb.width)];
    for (int u = 0; u < thumb.width; ++u) {
      if (support[u] == 0) continue;
      const int first = u;
      while (u < thumb.width && support[u] != 0) ++u;
      const int own = static_cast<int>(parent.size());
      parent.push_back(own);
      runs.push_back({v, first, u, own});
      while (above < row_start && (runs[above].row + 1 < v || runs[above].last <= first)) ++above;
      for (std::size_t k = above; k < row_start && runs[k].first < u; ++k)
        parent[static_cast<std::size_t>(root(runs[k].island))] = root(own);
    }
  }
  size.assign(parent.size(), 0);
  for (Run& run : runs) {
    run.island = root(run.island);
    size[static_cast<std::size_t>(run.island)] += run.last - run.first;
  }
  return runs;
}

/// The object that encloses the island, or 0. `island` marks the island's cells with `mark`.
std::uint16_t enclosing(const Thumbnail& thumb, const std::vector<int>& island, int mark, const std::vector<Run>& runs) {
  constexpr std::array<std::array<int, 2>, 4> kAround{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  std::map<std::uint16_t, std::size_t> borders;  // 0: anything that is no object
  std::size_t total = 0;
  const auto look = [&](int u0, int v0, int du, int dv) {
    for (int reach = 1; reach <= kIslandReach; ++reach) {
      const int u = u0 + reach * du, v = v0 + reach * dv;
      if (u < 0 || v < 0 || u >= thumb.width || v >= thumb.height) break;
      const auto to = static_cast<std::size_t>(v * thumb.width + u);
      if (island[to] == mark) return;
      if (thumb.object[to] == 0) continue;
      ++borders[thumb.object[to]];
      ++total;
      return;
    }
    ++borders[0];
    ++total;
  };
  for (const Run& run : runs)
    for (int u = run.first; u < run.last; ++u)
      for (const auto& [du, dv] : kAround) look(u, run.row, du, dv);
  for (const auto& [object, length] : borders)
    if (object != 0 && static_cast<double>(length) >= kIslandShare * static_cast<double>(total)) return object;
  return 0;
}

}  // namespace

ObjectLabels separate(const PointGrid& grid, Popout popout, const GroupingOptions& options) {
  const auto coarse = make_coarse_grid(grid, popout, options.threads);
  const auto patches = grow_patches(coarse, grid.pitch);
  const auto objects = group_patches(grid, coarse, patches, options);
  ObjectLabels labels;
  labels.support.assign(static_cast<std::size_t>(objects.count), 0);
  for (std::size_t k = 0; k < patches.list.size(); ++k)
    if (patches.list[k].cells > 0)
      labels.support[static_cast<std::size_t>(objects.of_patch[k])] = popout.support[patches.list[k].group - 1u];
  const auto cells = objects_of_cells(coarse, patches, objects);
  labels.of_point = std::move(popout.group);  // each point's group makes room for its object
  common::in_parallel(grid.height, kRowsAtOnce, options.threads, [&](int first, int last) {
    const auto width = static_cast<std::size_t>(grid.width);
    for (int v = first; v < last; ++v) {
      const std::size_t row = static_cast<std::size_t>(v) * width;
      for_each_run(labels.of_point, row, row + width, [&](std::size_t from, std::size_t to, std::uint16_t group) {
        const int cv = std::min(coarse.height - 1, v / coarse.stride);
        for (std::size_t i = from; i < to; ++i) {
          const int cu = std::min(coarse.width - 1, static_cast<int>(i - row) / coarse.stride);
          labels.of_point[i] = nearest_object(coarse, cells, grid.points[i], group, cu, cv);
        }
      });
    }
  });
  return labels;
}

void fill_basins(const PointGrid& grid, std::span<const std::uint16_t> planes, std::span<const std::uint8_t> supporting, int threads,
                 ObjectLabels& objects) {
  if (objects.support.empty()) return;  // no object, no basin
  const auto thumb = shrink(grid, planes, supporting, threads, objects);
  std::vector<std::size_t> size(objects.support.size() + 1, 0);
  for (const auto o : thumb.object) ++size[o];
  const std::size_t largest = *std::max_element(size.begin() + 1, size.end());
  std::vector<int> cells;
  const auto runs = find_islands(thumb, cells);
  // A support that is larger than any object is enclosed by none; most are.
  std::map<int, std::vector<Run>> islands;
  std::vector<int> island(thumb.object.size(), -1);
  for (const Run& run : runs) {
    const int count = cells[static_cast<std::size_t>(run.island)];
    if (count < kIslandCells || static_cast<std::size_t>(count) > largest) continue;
    islands[run.island].push_back(run);
    std::fill_n(island.begin() + run.row * thumb.width + run.first, run.last - run.first, run.island);
  }
  std::vector<std::uint16_t> filled(thumb.object.size(), 0);
  for (const auto& [number, parts] : islands) {
    const auto object = enclosing(thumb, island, number, parts);
    if (object == 0 || static_cast<std::size_t>(cells[static_cast<std::size_t>(number)]) > size[object]) continue;
    for (const Run& run : parts) std::fill_n(filled.begin() + run.row * thumb.width + run.first, run.last - run.first, object);
  }
  for (std::size_t at = 0; at < filled.size(); ++at) {
    if (filled[at] == 0) continue;
    const int u0 = static_cast<int>(at) % thumb.width * thumb.stride, v0 = static_cast<int>(at) / thumb.width * thumb.stride;
    for (int v = v0; v < v0 + thumb.stride; ++v)
      for (int u = u0; u < u0 + thumb.stride; ++u) {
        const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u);
        if (objects.of_point[i] == 0 && supporting[planes[i]] != 0) objects.of_point[i] = filled[at];
      }
  }
}

std::vector<SpaceOfInterest> make_spaces(const PointGrid& grid, std::span<const int> models, std::size_t min_points, double margin,
                                         int threads, ObjectLabels& objects) {
  std::vector<std::vector<std::uint32_t>> members(objects.support.size());
  for_each_run(objects.of_point, 0, grid.size(), [&](std::size_t first, std::size_t last, std::uint16_t object) {
    auto& of_object = members[object - 1u];
    of_object.resize(of_object.size() + (last - first));
    std::iota(of_object.end() - static_cast<std::ptrdiff_t>(last - first), of_object.end(), static_cast<std::uint32_t>(first));
  });
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < members.size(); ++k)
    if (members[k].size() >= std::max<std::size_t>(1, min_points)) order.push_back(k);
  // What is large and near takes up most of the view.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return members[a].size() > members[b].size(); });

  std::vector<SpaceOfInterest> spaces(order.size());
  common::in_parallel(static_cast<int>(order.size()), 1, threads, [&](int first, int last) {
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k) {
      SpaceOfInterest& soi = spaces[k];
      bounding_sphere(grid, members[order[k]], soi);
      soi.radius *= margin;
      soi.points = members[order[k]].size();
      soi.plane = models[static_cast<std::size_t>(objects.support[order[k]])];
      if (grid.organised()) soi.bbox = bounding_box(grid, members[order[k]]);
    }
  });
  std::vector<int> support;
  std::vector<std::uint16_t> number(members.size() + 1, 0);
  for (std::size_t k = 0; k < order.size(); ++k) {
    support.push_back(objects.support[order[k]]);
    number[order[k] + 1] = static_cast<std::uint16_t>(k + 1);
  }
  for_each_run(objects.of_point, 0, grid.size(), [&](std::size_t first, std::size_t last, std::uint16_t object) {
    std::fill(objects.of_point.begin() + static_cast<std::ptrdiff_t>(first), objects.of_point.begin() + static_cast<std::ptrdiff_t>(last),
              number[object]);
  });
  objects.support = std::move(support);
  return spaces;
}

}  // namespace swarmfit::perception
