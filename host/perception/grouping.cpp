#include "host/perception/grouping.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace swarmfit::perception {
namespace {

constexpr double kFragmentCells = 60;     // smaller pieces are no objects of their own beside a larger one
constexpr double kFragmentShare = 0.08;   // of the larger one's cells
constexpr double kHollow = -0.2;          // divergence below which a piece is the inside of something
constexpr float kRim = 0.03f;             // [m] the inside of a vessel is not higher than its outside
constexpr float kRimWidth = 0.02f;        // [m] between two parts of an inside
constexpr double kRimCells = 8;           // [cells] least border of a hollow and its shell
constexpr int kRimReach = 5;              // [cells] holes the border may have
constexpr int kVessel = 30;               // [cells] down the image from the far wall of a vessel to the near rim, over its floor
constexpr float kVesselWidth = 0.3f;      // [m] and that far in space
constexpr float kSlackSigmas = 6;         // of a depth, that rims may be off by
constexpr double kEnclosed = 0.8;         // of a basin's border
constexpr float kBelowRim = 0.01f;        // [m] a basin's top is at least this far below that of what encloses it
constexpr float kSameSurface = 0.978f;    // cosine of 12 degrees
constexpr float kOffSurface = 0.012f;     // [m]
constexpr float kBridge = 0.35f;          // [m] between the middles of two pieces of one surface
constexpr std::size_t kBridgeCells = 25;  // smaller patches do not tell their surface
constexpr std::size_t kSpread = 5;        // cells of a patch from which lines run to those of another
constexpr int kOpenOfHidden = 8;          // so many cells must be hidden for each that is not
constexpr double kHangingShare = 0.35;    // of what a piece hangs on, in cells: a handle is smaller
constexpr float kInFront = 0.005f;        // [m]
constexpr float kClear = 0.025f;          // [m] what is seen this far behind a piece's lower border does not carry it
constexpr double kMostlyClear = 0.5;      // of the lower border of a piece that hangs
constexpr double kHardlyStands = 0.1;     // of it, on what is no object
constexpr double kHardlyRests = 0.35;     // and on other pieces, which it may well touch

/// What a piece looks like as a whole.
struct Piece {
  std::size_t cells = 0;
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero();
  double divergence = 0;  // of the normals, seen from above: > 0 a body, < 0 a hollow
  float top = 0;          // [m] along up
};

/// Between two pieces in the image, in cells of the one's border.
struct Border {
  double all = 0;
  double near = 0;  ///< where the other is as near as a rim is wide
  double rim = 0;   ///< where the other is as high as the one's top and no farther off: a rim that is seen from outside
};

/// By a piece and what it borders on; -1 is what is no piece.
using Borders = std::map<std::pair<int, int>, Border>;

/// What is seen along lines between two patches of one plane, in cells.
struct Sight {
  int hidden = 0;  ///< something before that plane
  int open = 0;    ///< something in it or behind it
};

/// What lies right below a piece's lower border, in cells of the border.
struct Footing {
  double all = 0;
  double clear = 0;   ///< something well behind the piece
  double stands = 0;  ///< something near that is no object
  double rests = 0;   ///< another piece near
};

class Assembly {
 public:
  Assembly(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const Eigen::Vector3f& up, double noise,
           std::vector<int> parent)
      : grid_(grid), coarse_(coarse), patches_(patches), up_(up), noise_(static_cast<float>(noise)), parent_(std::move(parent)) {
    sort_cells();
    down_ = downwards();
  }

  void absorb_fragments(const Contacts& contacts);
  void close_hollows();
  void join_hanging(const Contacts& contacts);
  void bridge_occlusions();
  const std::vector<int>& parent() const { return parent_; }

 private:
  int owner(std::size_t cell) const { return patches_.label[cell] == 0 ? -1 : parent_[patches_.label[cell] - 1u]; }
  const Eigen::Vector3f& point_at(int u, int v) const {
    const auto at = static_cast<std::size_t>(v * coarse_.width + u);
    return owner(at) >= 0 ? coarse_.points[at]
                          : grid_.points[static_cast<std::size_t>(v * coarse_.stride) * static_cast<std::size_t>(grid_.width) +
                                         static_cast<std::size_t>(u * coarse_.stride)];
  }
  void join(int keep, int gone) {
    for (auto& p : parent_)
      if (p == gone) p = keep;
  }
  std::map<int, std::size_t> count_cells() const;
  void sort_cells();
  std::vector<std::uint32_t> cells_of(int root) const;
  Piece describe(int root) const;
  static void move_borders(int keep, int gone, Borders& borders);
  void measure_borders(int root, const Piece& piece, Borders& borders) const;
  Eigen::Vector2i downwards() const;
  std::map<int, Footing> find_footing() const;
  bool continues(const Patch& a, const Patch& b) const;
  bool hidden_between(std::size_t patch_a, std::size_t patch_b) const;
  void look_between(std::uint32_t from, std::uint32_t to, Sight& sight) const;

  const PointGrid& grid_;
  const CoarseGrid& coarse_;
  const Patches& patches_;
  Eigen::Vector3f up_;
  float noise_;  // of a depth at one metre
  Eigen::Vector2i down_;
  std::vector<std::vector<std::uint32_t>> cells_;  // of each patch, in the order of the image
  std::vector<int> parent_;                        // one a patch: the piece it belongs to
};

std::map<int, std::size_t> Assembly::count_cells() const {
  std::map<int, std::size_t> cells;
  for (std::size_t i = 0; i < parent_.size(); ++i) cells[parent_[i]] += patches_.list[i].cells;
  return cells;
}

void Assembly::sort_cells() {
  cells_.assign(patches_.list.size(), {});
  for (std::size_t at = 0; at < patches_.label.size(); ++at)
    if (patches_.label[at] != 0) cells_[patches_.label[at] - 1u].push_back(static_cast<std::uint32_t>(at));
}

std::vector<std::uint32_t> Assembly::cells_of(int root) const {
  std::vector<std::uint32_t> all;
  for (std::size_t i = 0; i < parent_.size(); ++i)
    if (parent_[i] == root) all.insert(all.end(), cells_[i].begin(), cells_[i].end());
  return all;
}

Piece Assembly::describe(int root) const {
  Piece piece;
  for (std::size_t i = 0; i < parent_.size(); ++i) {
    if (parent_[i] != root) continue;
    piece.cells += patches_.list[i].cells;
    piece.centroid += static_cast<float>(patches_.list[i].cells) * patches_.list[i].centroid;
  }
  piece.centroid /= static_cast<float>(std::max<std::size_t>(1, piece.cells));
  double along = 0, length = 0;
  std::vector<float> heights;
  heights.reserve(piece.cells);
  for (const auto at : cells_of(root)) {
    heights.push_back(up_.dot(coarse_.points[at]));
    const Eigen::Vector3f d = coarse_.points[at] - piece.centroid;
    const Eigen::Vector3f n = coarse_.normals[at] - up_ * up_.dot(coarse_.normals[at]), flat = d - up_ * up_.dot(d);
    along += static_cast<double>(n.dot(flat));
    length += static_cast<double>(n.norm() * flat.norm());
  }
  if (heights.empty()) return piece;
  piece.divergence = length > 0 ? along / length : 0;
  const auto high = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() * 95 / 100);
  std::nth_element(heights.begin(), high, heights.end());
  piece.top = *high;
  return piece;
}

/// Pieces too small to be told apart join the neighbour they touch most, the smallest first.
void Assembly::absorb_fragments(const Contacts& contacts) {
  while (true) {
    const auto cells = count_cells();
    std::map<std::pair<int, int>, double> touch;  // both ways
    for (const auto& [pair, contact] : contacts) {
      const int a = parent_[static_cast<std::size_t>(pair.first)], b = parent_[static_cast<std::size_t>(pair.second)];
      if (a == b) continue;
      touch[{a, b}] += contact.length;
      touch[{b, a}] += contact.length;
    }
    std::pair<int, int> best{-1, -1};
    double most = 0;
    for (const auto& [pair, length] : touch) {
      const auto size = cells.at(pair.first), larger = cells.at(pair.second);
      if (size >= larger || static_cast<double>(size) >= std::max(kFragmentCells, kFragmentShare * static_cast<double>(larger))) continue;
      const bool smaller = best.first < 0 || size < cells.at(best.first);
      if (!smaller && (pair.first != best.first || length <= most)) continue;
      best = pair;
      most = length;
    }
    if (best.first < 0) return;
    join(best.second, best.first);
  }
}

/// A piece's borders in the image. Of a hollow also those to the near rim, which its floor, that may be as low as the table, parts from
/// the wall that is seen.
void Assembly::measure_borders(int root, const Piece& piece, Borders& borders) const {
  const std::array<Eigen::Vector2i, 4> around{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  const auto measure = [&](int u, int v, const Eigen::Vector2i& step) {
    const auto& p = coarse_.points[static_cast<std::size_t>(v * coarse_.width + u)];
    const float slack = kSlackSigmas * noise_ * p.squaredNorm();
    const int farthest = step == down_ && piece.divergence < kHollow ? kVessel : kRimReach;
    for (int reach = 1; reach <= farthest; ++reach) {
      const int x = u + reach * step.x(), y = v + reach * step.y();
      if (x < 0 || y < 0 || x >= coarse_.width || y >= coarse_.height) break;
      const auto to = static_cast<std::size_t>(y * coarse_.width + x);
      const int other = owner(to);
      if (other < 0) continue;
      if (other == root) return;
      const auto& q = coarse_.points[to];
      const float apart = (p - q).norm();
      const bool as_high = std::abs(up_.dot(q) - piece.top) < kRim + slack, farther = q.norm() >= p.norm() + kBelowRim + slack;
      Border& border = borders[{root, other}];
      border.near += apart < kRimWidth + slack ? 1 : 0;
      border.rim += as_high && !farther && apart < kVesselWidth ? 1 : 0;
      if (reach > kRimReach) break;
      border.all += 1;
      return;
    }
    borders[{root, -1}].all += 1;
  };
  for (const auto at : cells_of(root)) {
    const int u = static_cast<int>(at) % coarse_.width, v = static_cast<int>(at) / coarse_.width;
    for (const auto& step : around) measure(u, v, step);
  }
}

/// The inside of a pot or cup goes with its outside: the parts of a hollow lie side by side, and its shell is seen at its rim, before what is
/// inside. What stands behind a rim, or before it but higher or lower, is something else. A basin lies within what encloses it.
void Assembly::close_hollows() {
  std::map<int, Piece> pieces;
  Borders borders;
  for (const int root : parent_)
    if (pieces.count(root) == 0) measure_borders(root, pieces[root] = describe(root), borders);
  std::set<int> closed;  // hollows that have found their shells, which may look hollow still
  const auto is_hollow = [&](int piece) { return closed.count(piece) == 0 && pieces.at(piece).divergence < kHollow; };
  while (true) {
    std::map<int, double> around;
    for (const auto& [pair, border] : borders) around[pair.first] += border.all;
    std::pair<int, int> best{-1, -1};
    double most = kRimCells;
    for (const auto& [pair, border] : borders) {
      if (pair.second < 0) continue;
      const auto &piece = pieces.at(pair.first), &other = pieces.at(pair.second);
      const bool basin = border.all > kEnclosed * around.at(pair.first) && piece.top < other.top - kBelowRim;
      const bool hollow = is_hollow(pair.first) && piece.top < other.top + kRim;
      const double length = basin ? border.all : !hollow ? 0 : is_hollow(pair.second) ? border.near : border.rim;
      if (length <= most) continue;
      most = length;
      best = pair;
    }
    const auto [gone, keep] = best;
    if (gone < 0) return;
    if (!is_hollow(keep) && pieces.at(keep).divergence > -kHollow) closed.insert(keep);
    join(keep, gone);
    pieces.erase(gone);
    move_borders(keep, gone, borders);
    measure_borders(keep, pieces[keep] = describe(keep), borders);
  }
}

/// What others share with the one that is gone they share with the one that stays; what the two themselves have is to be measured anew.
void Assembly::move_borders(int keep, int gone, Borders& borders) {
  for (auto it = borders.begin(); it != borders.end();) {
    const auto [from, to] = it->first;
    const bool of_others = from != keep && from != gone;
    if (of_others && to != gone) {
      ++it;
      continue;
    }
    if (of_others) {
      Border& all = borders[{from, keep}];
      all.all += it->second.all;
      all.near += it->second.near;
      all.rim += it->second.rim;
    }
    it = borders.erase(it);
  }
}

/// The step in the image that leads most straight down in space.
Eigen::Vector2i Assembly::downwards() const {
  Eigen::Vector2f rise = Eigen::Vector2f::Zero();
  const auto width = static_cast<std::size_t>(coarse_.width);
  for (std::size_t at = 0; at + width < patches_.label.size(); ++at) {
    if (patches_.label[at] == 0) continue;
    if (patches_.label[at + 1] == patches_.label[at]) rise.x() += up_.dot(coarse_.points[at + 1] - coarse_.points[at]);
    if (patches_.label[at + width] == patches_.label[at]) rise.y() += up_.dot(coarse_.points[at + width] - coarse_.points[at]);
  }
  if (std::abs(rise.x()) > std::abs(rise.y())) return {rise.x() > 0 ? -1 : 1, 0};
  return {0, rise.y() > 0 ? -1 : 1};
}

std::map<int, Footing> Assembly::find_footing() const {
  std::map<int, Footing> footing;
  for (int v = 0; v < coarse_.height; ++v)
    for (int u = 0; u < coarse_.width; ++u) {
      const auto at = static_cast<std::size_t>(v * coarse_.width + u);
      const int o = owner(at);
      if (o < 0) continue;
      Footing border;
      for (int reach = 1; reach <= kRimReach; ++reach) {
        const int x = u + reach * down_.x(), y = v + reach * down_.y();
        if (x < 0 || y < 0 || x >= coarse_.width || y >= coarse_.height) break;
        const int other = owner(static_cast<std::size_t>(y * coarse_.width + x));
        if (other == o) break;  // no border
        border.all = 1;
        const auto& p = point_at(x, y);
        if (!PointGrid::seen(p)) continue;  // a hole: look across it
        const bool near = (p - coarse_.points[at]).norm() < kClear;
        if (near)
          (other >= 0 ? border.rests : border.stands) = 1;
        else if (p.norm() > coarse_.points[at].norm())
          border.clear = 1;
        break;
      }
      Footing& sum = footing[o];
      sum.all += border.all;
      sum.clear += border.clear;
      sum.stands += border.stands;
      sum.rests += border.rests;
    }
  return footing;
}

/// A piece that neither stands nor rests on anything hangs on what it touches: a handle, a spout, a brim.
void Assembly::join_hanging(const Contacts& contacts) {
  while (true) {
    const auto footing = find_footing();
    const auto cells = count_cells();
    std::map<std::pair<int, int>, double> touch;  // of the hanging
    for (const auto& [pair, contact] : contacts)
      for (const auto& [one, other] : {pair, std::pair{pair.second, pair.first}}) {
        const int a = parent_[static_cast<std::size_t>(one)], b = parent_[static_cast<std::size_t>(other)];
        const auto found = footing.find(a);
        if (a == b || found == footing.end()) continue;
        if (static_cast<double>(cells.at(a)) >= kHangingShare * static_cast<double>(cells.at(b))) continue;
        const Footing& f = found->second;
        if (f.clear > kMostlyClear * f.all && f.stands < kHardlyStands * f.all && f.rests < kHardlyRests * f.all)
          touch[{a, b}] += contact.length;
      }
    const auto most = std::max_element(touch.begin(), touch.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == touch.end()) return;
    join(most->first.second, most->first.first);
  }
}

/// Two patches that may be one surface.
bool Assembly::continues(const Patch& a, const Patch& b) const {
  if (a.cells < kBridgeCells || b.cells < kBridgeCells || a.normal.dot(b.normal) < kSameSurface) return false;
  const Eigen::Vector3f d = a.centroid - b.centroid;
  return d.norm() < kBridge && std::abs(d.dot(a.normal)) < kOffSurface && std::abs(d.dot(b.normal)) < kOffSurface;
}

/// Whether what is seen between two patches lies in front of the surface that would join them: from cells spread over the one to cells
/// spread over the other, as a face is convex.
bool Assembly::hidden_between(std::size_t patch_a, std::size_t patch_b) const {
  const auto pick = [&](std::size_t patch, std::size_t k) { return cells_[patch][(2 * k + 1) * cells_[patch].size() / (2 * kSpread)]; };
  Sight sight;
  for (std::size_t a = 0; a < kSpread; ++a)
    for (std::size_t b = 0; b < kSpread; ++b) look_between(pick(patch_a, a), pick(patch_b, b), sight);
  return sight.hidden > 0 && sight.open * kOpenOfHidden <= sight.hidden;
}

void Assembly::look_between(std::uint32_t from, std::uint32_t to, Sight& sight) const {
  const auto width = static_cast<std::uint32_t>(coarse_.width);
  const Eigen::Vector2f a(static_cast<float>(from % width), static_cast<float>(from / width)),
      b(static_cast<float>(to % width), static_cast<float>(to / width));
  const float near_a = 1 / coarse_.points[from].norm(), near_b = 1 / coarse_.points[to].norm();
  const int steps = std::max(1, static_cast<int>((b - a).norm()));
  for (int k = 0; k <= steps; ++k) {
    const float t = static_cast<float>(k) / static_cast<float>(steps);
    const Eigen::Vector2i q = (a + t * (b - a)).array().round().cast<int>();
    const auto at = static_cast<std::size_t>(q.y() * coarse_.width + q.x());
    if (patches_.label[at] == patches_.label[from] || patches_.label[at] == patches_.label[to]) continue;
    const auto& p = point_at(q.x(), q.y());
    if (!PointGrid::seen(p)) continue;
    // Along a line in the image the inverse of the depth of a plane is linear.
    const float expected = 1 / ((1 - t) * near_a + t * near_b);
    ++(p.norm() < expected - kInFront ? sight.hidden : sight.open);
  }
}

/// Pieces of one thing to both sides of what stands before it.
void Assembly::bridge_occlusions() {
  for (std::size_t a = 0; a < patches_.list.size(); ++a)
    for (std::size_t b = a + 1; b < patches_.list.size(); ++b) {
      if (parent_[a] == parent_[b] || !continues(patches_.list[a], patches_.list[b]) || !hidden_between(a, b)) continue;
      join(std::min(parent_[a], parent_[b]), std::max(parent_[a], parent_[b]));
    }
}

}  // namespace

Objects group_patches(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const GroupingOptions& options) {
  const auto contacts = measure_contacts(grid, coarse, patches, options);
  Assembly assembly(grid, coarse, patches, options.up, options.noise, contract(coarse, patches, contacts));
  assembly.bridge_occlusions();
  assembly.close_hollows();
  assembly.absorb_fragments(contacts);
  assembly.join_hanging(contacts);
  Objects objects;
  std::vector<int> number(patches.list.size(), -1);
  for (const int root : assembly.parent()) {
    auto& n = number[static_cast<std::size_t>(root)];
    if (n < 0) n = objects.count++;
    objects.of_patch.push_back(n);
  }
  return objects;
}

}  // namespace swarmfit::perception
