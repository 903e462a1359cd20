#include "host/perception/overview.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Geometry>

#include "host/common/parallel.hpp"
#include "host/perception/stereo_normals.hpp"

namespace swarmfit::perception {
namespace {

constexpr int kCoarseWidth = 320;
constexpr int kBaseline = 4;         // [cells] over which a normal is taken
constexpr float kBlockReach = 4.0f;  // points of a block are within this many footprints of its first: no mean across a depth edge
constexpr int kEdgeReach = 2;        // [px]
constexpr int kEdge = 15;            // sum of the three channels: below is noise
constexpr int kRowsAtOnce = 16;      // of cells, that one thread works on
constexpr float kBend = 0.3f;        // of the baseline's length: farther off its middle the surface bends

/// Rows [row, end) of cells.
void average_blocks(const PointGrid& grid, int row, int end, Overview& overview) {
  auto& cells = overview.cells;
  for (int cv = row; cv < end; ++cv)
    for (int cu = 0; cu < cells.width; ++cu) {
      Eigen::Vector3f first = Eigen::Vector3f::Zero(), sum = Eigen::Vector3f::Zero();
      float count = 0, reach = 0;
      for (int v = cv * overview.stride; v < (cv + 1) * overview.stride; ++v)
        for (int u = cu * overview.stride; u < (cu + 1) * overview.stride; ++u) {
          const auto& p = grid.points[static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u)];
          if (!PointGrid::seen(p)) continue;
          if (count == 0) {
            first = p;
            const float radius = kBlockReach * static_cast<float>(overview.stride) * grid.pitch;
            reach = radius * radius * p.squaredNorm();
          } else if ((p - first).squaredNorm() > reach) {
            continue;
          }
          sum += p;
          ++count;
        }
      if (count == 0) continue;
      cells.points[static_cast<std::size_t>(cv * cells.width + cu)] = sum / count;
    }
}

/// From differences across the cell both ways; zero unless the cell lies amid them.
Eigen::Vector3f normal_at(const PointGrid& cells, int u, int v) {
  const auto at = [&](int x, int y) -> const Eigen::Vector3f& { return cells.points[static_cast<std::size_t>(y * cells.width + x)]; };
  const auto &here = at(u, v), &left = at(u - kBaseline, v), &right = at(u + kBaseline, v), &above = at(u, v - kBaseline),
             &below = at(u, v + kBaseline);
  const Eigen::Vector3f across = right - left, along = below - above;
  const float bend_across = (right + left - 2 * here).squaredNorm(), bend_along = (below + above - 2 * here).squaredNorm();
  // NaN fails these as well.
  if (!(bend_across < kBend * kBend * across.squaredNorm() && bend_along < kBend * kBend * along.squaredNorm()))
    return Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = across.cross(along);
  const float length = normal.norm();
  if (!(length > 0)) return Eigen::Vector3f::Zero();
  normal /= length;
  return normal.dot(here) > 0 ? Eigen::Vector3f(-normal) : normal;
}

/// Cells with or beside an edge across the epipolar lines, which are the image's rows.
std::vector<std::uint8_t> find_texture(const Cloud& frame, const Overview& overview) {
  const auto& cells = overview.cells;
  const auto brightness = [&](int u, int v) {
    const auto i = 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(u));
    return frame.rgb[i] + frame.rgb[i + 1] + frame.rgb[i + 2];
  };
  std::vector<std::uint8_t> edge(cells.size(), 0), textured(cells.size(), 0);
  for (int v = 0; v < cells.height * overview.stride; ++v)
    for (int u = kEdgeReach; u < cells.width * overview.stride && u + kEdgeReach < frame.width; ++u)
      if (std::abs(brightness(u + kEdgeReach, v) - brightness(u - kEdgeReach, v)) >= kEdge)
        edge[static_cast<std::size_t>((v / overview.stride) * cells.width + u / overview.stride)] = 1;
  for (int v = 1; v + 1 < cells.height; ++v)
    for (int u = 1; u + 1 < cells.width; ++u) {
      const auto at = static_cast<std::size_t>(v * cells.width + u);
      textured[at] = edge[at] | edge[at - 1] | edge[at + 1];
    }
  return textured;
}

/// With no branch on what is unpredictable.
template <class Predicate>
std::vector<std::uint32_t> cells_where(const Overview& overview, const Predicate& predicate) {
  std::vector<std::uint32_t> chosen(overview.cells.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[count] = static_cast<std::uint32_t>(i);
    count += predicate(i) ? 1 : 0;
  }
  chosen.resize(count);
  return chosen;
}

}  // namespace

Overview make_overview(const PointGrid& grid, const Cloud& frame, int threads) {
  Overview overview;
  if (!grid.organised()) {
    overview.cells = grid;
    return overview;
  }
  auto& cells = overview.cells;
  overview.stride = std::max(1, (grid.width + kCoarseWidth / 2) / kCoarseWidth);
  cells.width = grid.width / overview.stride;
  cells.height = grid.height / overview.stride;
  cells.origin = grid.origin;
  cells.pitch = grid.pitch * static_cast<float>(overview.stride);
  const auto count = static_cast<std::size_t>(cells.width) * static_cast<std::size_t>(cells.height);
  cells.points.assign(count, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  common::in_parallel(cells.height, kRowsAtOnce, threads, [&](int first, int last) { average_blocks(grid, first, last, overview); });
  cells.finite = static_cast<std::size_t>(std::count_if(cells.points.begin(), cells.points.end(), PointGrid::seen));
  if (frame.passive_stereo && frame.coloured()) {
    overview.textured = find_texture(frame, overview);
    overview.normals = stereo_normals(cells, overview.textured, threads);
    return overview;
  }
  overview.normals.assign(count, Eigen::Vector3f::Zero());
  common::in_parallel(cells.height, kRowsAtOnce, threads, [&](int first, int last) {
    for (int v = std::max(first, kBaseline); v < std::min(last, cells.height - kBaseline); ++v)
      for (int u = kBaseline; u + kBaseline < cells.width; ++u)
        overview.normals[static_cast<std::size_t>(v * cells.width + u)] = normal_at(cells, u, v);
  });
  return overview;
}

std::vector<std::uint32_t> flat_cells(const Overview& overview) {
  if (overview.has_normals() && !overview.stereo())
    return cells_where(overview, [&](std::size_t i) { return overview.normals[i].squaredNorm() > 0; });
  return cells_where(overview, [&](std::size_t i) {
    return PointGrid::seen(overview.cells.points[i]) && (!overview.stereo() || overview.textured[i] != 0);
  });
}

std::vector<std::uint32_t> flat_cells(const Overview& overview, const Eigen::Vector3f& normal, float least_cosine) {
  if (!overview.has_normals()) return flat_cells(overview);  // all agree
  if (overview.stereo()) {
    auto chosen = flat_cells(overview);
    std::erase_if(chosen, [&](std::uint32_t i) { return !overview.agrees(i, normal, least_cosine); });
    return chosen;
  }
  // Where a cell is not flat its normal is zero, and agrees with nothing.
  return cells_where(overview, [&](std::size_t i) { return overview.agrees(i, normal, least_cosine); });
}

}  // namespace swarmfit::perception
