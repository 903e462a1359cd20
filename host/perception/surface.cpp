#include "host/perception/surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Eigenvalues>

namespace swarmfit::perception {
namespace {

constexpr float kCell = 0.02f;                  // [m] finest cell
constexpr int kMostCells = 512;                 // along a side; a hall gets coarser cells
constexpr float kGap = 0.12f;                   // [m] parts of a plane this near are one surface: things stand in between and throw shadows
constexpr float kEdge = 0.05f;                  // [m] nearer to the hull is its edge
constexpr int kUnbroken = 2;                    // [cells] a piece has no wider gaps
constexpr double kSplinter = 0.03;              // of the largest surface's area; smaller parts are none
constexpr double kTopArea = 0.07;               // [m^2] the largest top of a thing that is carried
constexpr double kTopLength = 0.45;             // [m] and its longest side
constexpr double kSeatHeight = 0.28;            // [m] from here on it is rather a piece of furniture, and a thing's top is smaller:
constexpr double kHighTopArea = 0.03;           // [m^2]
constexpr double kTopsShare = 0.3;              // of the area below that tops beside each other take up at most,
constexpr double kTopsTilt = 0.07;              // [rad] unless they are the tops of several heights
constexpr double kWalled = 0.35;                // of the border of a top, below which sides go down
constexpr float kSidesFrom = 0.15f;             // of the way down: a board's edge ends before, sides go on,
constexpr float kSidesTo = 0.85f;               // and what is lower may be the foot of something else
constexpr float kFootTo = 1.5f;                 // what is seen so far down tells that nothing goes down before it
constexpr int kPointsOfSide = 3;                // in each half of the way, about a cell of the border
constexpr double kReasonableArea = 0.01;        // [m^2] nothing smaller carries anything
constexpr std::size_t kPointsForNoise = 16384;  // of a frame are looked at
constexpr float kNoiseAtOneMetre = 0.0015f;     // [m] where there are too few inliers to measure it

using Points2 = std::vector<Eigen::Vector2f>;

/// The first and the last of each row of cells; the hull of all is that of these.
Points2 row_ends(const Points2& cells) {
  Points2 ends;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (i == 0 || i + 1 == cells.size() || cells[i - 1].y() != cells[i].y() || cells[i + 1].y() != cells[i].y()) ends.push_back(cells[i]);
  return ends;
}

/// Andrew's monotone chain, counter-clockwise.
Points2 convex_hull(Points2 points) {
  const auto less = [](const Eigen::Vector2f& a, const Eigen::Vector2f& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); };
  std::sort(points.begin(), points.end(), less);
  if (points.size() < 3) return points;
  Points2 hull(2 * points.size());
  std::size_t k = 0;
  const auto turns_right = [&](const Eigen::Vector2f& p) {
    const Eigen::Vector2f a = hull[k - 1] - hull[k - 2], b = p - hull[k - 2];
    return a.x() * b.y() - a.y() * b.x() <= 0;
  };
  for (const auto& p : points) {
    while (k >= 2 && turns_right(p)) --k;
    hull[k++] = p;
  }
  const std::size_t lower = k + 1;
  for (auto it = points.rbegin() + 1; it != points.rend(); ++it) {
    while (k >= lower && turns_right(*it)) --k;
    hull[k++] = *it;
  }
  hull.resize(k - 1);
  return hull;
}

double polygon_area(const Points2& hull) {
  double twice = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const auto &a = hull[i], &b = hull[(i + 1) % hull.size()];
    twice += static_cast<double>(a.x()) * b.y() - static_cast<double>(a.y()) * b.x();
  }
  return std::abs(twice) / 2;
}

/// Longest side along the principal axis.
double principal_length(const Points2& points) {
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<float>(points.size());
  Eigen::Matrix2f scatter = Eigen::Matrix2f::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector2f axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f>(scatter).eigenvectors().col(1);
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  for (const auto& p : points) {
    low = std::min(low, axis.dot(p));
    high = std::max(high, axis.dot(p));
  }
  return high - low;
}

/// Of a bitmap row after row: 1 where a cell in the square of `before` cells to the left and above and `after` to the right and below is
/// set.
std::vector<std::uint8_t> widen(const std::vector<std::uint8_t>& set, int columns, int rows, int before, int after) {
  const auto sweep = [&](const std::vector<std::uint8_t>& from, int lines, std::size_t line, int length, std::size_t step) {
    std::vector<std::uint8_t> to(from.size(), 0);
    for (int l = 0; l < lines; ++l) {
      const std::size_t start = static_cast<std::size_t>(l) * line;
      int last = -1;  // of the cells marked so far
      for (int k = 0; k < length; ++k) {
        if (from[start + static_cast<std::size_t>(k) * step] == 0) continue;
        for (int m = std::max(last + 1, k - after); m <= std::min(length - 1, k + before); ++m)
          to[start + static_cast<std::size_t>(m) * step] = 1;
        last = std::min(length - 1, k + before);
      }
    }
    return to;
  };
  const auto width = static_cast<std::size_t>(columns);
  return sweep(sweep(set, rows, width, columns, 1), columns, 1, rows, width);
}

/// Cells within `margin` of the convex polygon become 1, those well inside it 2.
void fill_hull(const Points2& hull, float margin, Surface& surface) {
  struct Span {
    float low = std::numeric_limits<float>::lowest(), high = std::numeric_limits<float>::max();
    /// Keeps the x with slope * x + offset >= 0.
    void clip(float slope, float offset) {
      if (slope > 0)
        low = std::max(low, -offset / slope);
      else if (slope < 0)
        high = std::min(high, -offset / slope);
      else if (offset < 0)
        high = std::numeric_limits<float>::lowest();
    }
  };
  const auto mark = [&](int row, const Span& span, std::uint8_t value) {
    const auto column = [&](float x) {
      return std::clamp((x - surface.low.x()) / surface.cell - 0.5f, -1.0f, static_cast<float>(surface.columns));
    };
    const int first = std::max(0, static_cast<int>(std::ceil(column(span.low)))),
              last = std::min(surface.columns - 1, static_cast<int>(std::floor(column(span.high))));
    for (int a = first; a <= last; ++a) {
      auto& cell = surface.extent[static_cast<std::size_t>(row * surface.columns + a)];
      cell = std::max(cell, value);
    }
  };
  for (int b = 0; b < surface.rows; ++b) {
    const float y = surface.low.y() + surface.cell * (static_cast<float>(b) + 0.5f);
    Span within, well_inside;
    for (std::size_t i = 0; i < hull.size(); ++i) {
      // Depth of (x, y) behind this edge: linear in x.
      const Eigen::Vector2f edge = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
      const float offset = edge.x() * (y - hull[i].y()) + edge.y() * hull[i].x();
      within.clip(-edge.y(), offset + margin);
      well_inside.clip(-edge.y(), offset - kEdge);
    }
    mark(b, within, 1);
    mark(b, well_inside, 2);
  }
}

/// Groups of occupied cells with gaps of at most `reach` cells; 0 where nothing is, k the k-th group.
std::vector<int> group_cells(const std::vector<int>& hits, int columns, int rows, int reach, int* groups) {
  std::vector<std::uint8_t> occupied(hits.size());
  for (std::size_t at = 0; at < hits.size(); ++at) occupied[at] = hits[at] != 0;
  // Two cells are within reach of each other where their squares of reach x reach cells touch or overlap.
  const auto wide = widen(occupied, columns, rows, reach - 1, 0);
  std::vector<int> group(hits.size(), 0), stack;
  *groups = 0;
  for (std::size_t seed = 0; seed < hits.size(); ++seed) {
    if (hits[seed] == 0 || group[seed] != 0) continue;
    group[seed] = ++*groups;
    stack.assign(1, static_cast<int>(seed));
    while (!stack.empty()) {
      const int at = stack.back(), a0 = at % columns, b0 = at / columns;
      stack.pop_back();
      for (int b = std::max(0, b0 - 1); b <= std::min(rows - 1, b0 + 1); ++b)
        for (int a = std::max(0, a0 - 1); a <= std::min(columns - 1, a0 + 1); ++a) {
          const auto to = static_cast<std::size_t>(b * columns + a);
          if (wide[to] == 0 || group[to] != 0) continue;
          group[to] = *groups;
          stack.push_back(static_cast<int>(to));
        }
    }
  }
  for (std::size_t at = 0; at < hits.size(); ++at)
    if (hits[at] == 0) group[at] = 0;
  return group;
}

/// Centres of the cells of each group, in the plane's coordinates.
std::vector<Points2> cells_by_group(const std::vector<int>& group, int groups, const Surface& surface) {
  std::vector<Points2> cells(static_cast<std::size_t>(groups));
  const auto columns = static_cast<std::size_t>(surface.columns);
  for (std::size_t at = 0; at < group.size(); ++at)
    if (group[at] != 0)
      cells[static_cast<std::size_t>(group[at] - 1)].push_back(
          surface.low + surface.cell * Eigen::Vector2f(static_cast<float>(at % columns) + 0.5f, static_cast<float>(at / columns) + 0.5f));
  return cells;
}

/// Cells of the largest piece without gaps.
Points2 largest_piece(const std::vector<int>& hits, const Surface& surface) {
  int groups = 0;
  const auto group = group_cells(hits, surface.columns, surface.rows, kUnbroken, &groups);
  auto cells = cells_by_group(group, groups, surface);
  return *std::max_element(cells.begin(), cells.end(), [](const Points2& a, const Points2& b) { return a.size() < b.size(); });
}

void lay_out_cells(std::span<const Eigen::Vector2f> places, double margin, Surface& surface) {
  Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const auto& q : places) {
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const auto pad = static_cast<float>(margin);
  surface.low = low - Eigen::Vector2f::Constant(pad);
  const Eigen::Vector2f size = high - low + Eigen::Vector2f::Constant(2 * pad);
  surface.cell = std::max(kCell, size.maxCoeff() / kMostCells);
  surface.per_metre = 1 / surface.cell;
  surface.columns = static_cast<int>(size.x() / surface.cell) + 1;
  surface.rows = static_cast<int>(size.y() / surface.cell) + 1;
}

/// How far `small` lies above `large`, within its extent; nothing where it does not.
std::optional<double> rise_above(const Surface& small, const Surface& large) {
  std::size_t over = 0, cells = 0;
  double rise = 0;
  for (int b = 0; b < small.rows; ++b)
    for (int a = 0; a < small.columns; ++a) {
      if (small.component[static_cast<std::size_t>(b * small.columns + a)] == 0) continue;
      const Eigen::Vector3f p = -small.plane.offset * small.plane.normal +
                                (small.low.x() + (static_cast<float>(a) + 0.5f) * small.cell) * small.axis_a +
                                (small.low.y() + (static_cast<float>(b) + 0.5f) * small.cell) * small.axis_b;
      ++cells;
      over += large.contains(p) ? 1 : 0;
      rise += static_cast<double>(large.plane.height(p));
    }
  if (cells == 0 || 2 * over <= cells || rise <= 0) return std::nullopt;
  return rise / static_cast<double>(cells);
}

/// Share of the border of `top` below which something goes all the way down to `base`, `rise` further down: the sides of things. Of the
/// border below which anything is seen.
double walled_share(const PointGrid& grid, const Surface& top, double rise) {
  const auto cells = top.component.size();
  std::vector<int> upper(cells, 0), lower(cells, 0), foot(cells, 0);
  const auto way = static_cast<float>(rise);
  for (const auto& p : grid.points) {
    const float down = -top.plane.height(p) / way;
    if (!(down > kSidesFrom && down < kFootTo)) continue;  // nor where nothing was seen
    const int at = top.cell_of(p);
    if (at >= 0) ++(down < 0.5f ? upper : down < kSidesTo ? lower : foot)[static_cast<std::size_t>(at)];
  }
  std::size_t walled = 0, seen = 0;
  for (int b = 1; b + 1 < top.rows; ++b)
    for (int a = 1; a + 1 < top.columns; ++a) {
      const auto at = static_cast<std::size_t>(b * top.columns + a), row = static_cast<std::size_t>(top.columns);
      if (top.component[at] == 0) continue;
      int around = 0, high = 0, low = 0, floor = 0;
      for (const std::size_t line : {at - row, at, at + row})
        for (const std::size_t to : {line - 1, line, line + 1}) {
          around += top.component[to];
          high += upper[to];
          low += lower[to];
          floor += foot[to];
        }
      if (around == 9 || high + low + floor < kPointsOfSide) continue;
      ++seen;
      walled += high >= kPointsOfSide && low >= kPointsOfSide ? 1 : 0;
    }
  return seen == 0 ? 0 : static_cast<double>(walled) / static_cast<double>(seen);
}

/// The top of a thing, or those of several beside each other, that stand on `base`.
bool is_top(const PointGrid& grid, const Surface& top, const Surface& base, double max_height) {
  const auto rise = rise_above(top, base);
  if (!rise || *rise >= max_height) return false;
  const bool low = *rise < kSeatHeight, one = top.piece_area < kTopArea && top.piece_length < kTopLength;
  if (one) return low || top.piece_area < kHighTopArea;
  if (!low) return false;
  const double tilt = std::acos(std::min(1.0, static_cast<double>(top.plane.normal.dot(base.plane.normal))));
  return (top.area <= kTopsShare * base.area || tilt > kTopsTilt) && walled_share(grid, top, *rise) > kWalled;
}

}  // namespace

Surface lay_axes(const LocalPlane& plane, int model) {
  Surface surface;
  surface.plane = plane;
  surface.model = model;
  surface.axis_a = plane.normal.unitOrthogonal();
  surface.axis_b = plane.normal.cross(surface.axis_a);
  surface.noise = kNoiseAtOneMetre;
  return surface;
}

Surface make_surface(const PointGrid& grid, std::span<const std::uint16_t> labels, int model, const LocalPlane& plane, double margin) {
  Surface surface = lay_axes(plane, model);
  std::vector<Eigen::Vector2f> places;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (labels[i] == model && PointGrid::seen(grid.points[i])) places.push_back(surface.place_of(grid.points[i]));
  fill_surface(places, margin, surface);
  return surface;
}

void fill_surface(std::span<const Eigen::Vector2f> places, double margin, Surface& surface) {
  if (places.empty()) return;
  lay_out_cells(places, margin, surface);

  std::vector<int> hits(static_cast<std::size_t>(surface.columns) * static_cast<std::size_t>(surface.rows), 0);
  for (const auto& q : places)
    if (const int at = surface.cell_at(q); at >= 0) ++hits[static_cast<std::size_t>(at)];
  int groups = 0;
  const auto group = group_cells(hits, surface.columns, surface.rows, std::max(1, static_cast<int>(kGap / surface.cell)), &groups);

  const auto cells = cells_by_group(group, groups, surface);
  std::size_t largest = 0;
  for (const auto& part : cells) largest = std::max(largest, part.size());
  surface.extent.assign(hits.size(), 0);
  surface.component.assign(hits.size(), 0);
  surface.area = 0;
  const double cell_area = static_cast<double>(surface.cell) * static_cast<double>(surface.cell);
  std::vector<bool> kept(cells.size());
  for (std::size_t g = 0; g < cells.size(); ++g) {
    kept[g] = static_cast<double>(cells[g].size()) >= kSplinter * static_cast<double>(largest);
    if (!kept[g]) continue;
    const auto hull = convex_hull(row_ends(cells[g]));
    if (hull.size() >= 3) fill_hull(hull, static_cast<float>(margin), surface);
    surface.area += cell_area * static_cast<double>(cells[g].size());
  }
  const auto piece = largest_piece(hits, surface);
  surface.piece_area = polygon_area(convex_hull(row_ends(piece)));
  surface.piece_length = principal_length(piece);
  for (std::size_t at = 0; at < group.size(); ++at) surface.component[at] = group[at] != 0 && kept[static_cast<std::size_t>(group[at] - 1)];
}

std::vector<std::uint8_t> Surface::near_component(float reach) const {
  const int steps = static_cast<int>(reach / cell);
  return widen(component, columns, rows, steps, steps);
}

double measure_noise(const PointGrid& grid, std::span<const std::uint16_t> labels, const Surface& surface) {
  std::vector<float> scaled;
  const std::size_t step = std::max<std::size_t>(1, grid.size() / kPointsForNoise) | 1U;  // odd: not one column of the image
  for (std::size_t i = 0; i < grid.size(); i += step)
    if (labels[i] == surface.model)
      scaled.push_back(std::abs(surface.plane.height(grid.points[i])) / std::max(0.25f, grid.points[i].squaredNorm()));
  if (scaled.size() < 50 || !grid.organised()) return kNoiseAtOneMetre;
  const auto middle = scaled.begin() + static_cast<std::ptrdiff_t>(scaled.size() / 2);
  std::nth_element(scaled.begin(), middle, scaled.end());
  return 1.4826 * static_cast<double>(*middle);
}

std::vector<bool> choose_supporting(const PointGrid& grid, std::span<const Surface> surfaces, double max_height) {
  std::vector<bool> supporting(surfaces.size(), false);
  std::vector<std::size_t> by_area(surfaces.size());
  std::iota(by_area.begin(), by_area.end(), std::size_t{0});
  std::stable_sort(by_area.begin(), by_area.end(), [&](std::size_t a, std::size_t b) { return surfaces[a].area > surfaces[b].area; });
  for (const auto i : by_area) {
    if (surfaces[i].area < kReasonableArea) continue;
    supporting[i] = true;
    for (std::size_t j = 0; j < surfaces.size() && supporting[i]; ++j) {
      if (j == i || !supporting[j] || surfaces[j].area <= 2 * surfaces[i].area) continue;
      supporting[i] = !is_top(grid, surfaces[i], surfaces[j], max_height);
    }
  }
  return supporting;
}

}  // namespace swarmfit::perception
