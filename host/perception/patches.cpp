#include "host/perception/patches.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Eigenvalues>

#include "host/common/parallel.hpp"

namespace swarmfit::perception {
namespace {

constexpr int kCoarseWidth = 320;     // [cells] fine enough for a cup's handle, coarse enough for a few milliseconds
constexpr int kNormalRadius = 3;      // [cells]
constexpr float kNormalReach = 2.2f;  // neighbours are within this many footprints times the radius: slanted faces are stretched
constexpr float kFewNeighbours = 6;
constexpr int kRowsAtOnce = 8;           // of cells, that one thread works on
constexpr double kSameFace = 0.965;      // cosine between a cell's normal and its patch's mean: 15.2 degrees,
constexpr double kSameRoughFace = 0.93;  // 21.6 where normals are unsteady
constexpr double kSmallPatch = 8;        // [cells]
constexpr double kSmallRoughPatch = 12;
constexpr float kSteady = 0.04f;    // [rad] that normals of a face differ by, good ones, of a depth camera nearby
constexpr float kUnsteady = 0.08f;  // and of a noisy one, or of stereo

/// Rows [row, end) of cells.
void average_blocks(const PointGrid& grid, const Popout& popout, int row, int end, CoarseGrid& coarse) {
  for (int cv = row; cv < end; ++cv)
    for (int cu = 0; cu < coarse.width; ++cu) {
      const auto at = static_cast<std::size_t>(cv * coarse.width + cu);
      Eigen::Vector3f sum = Eigen::Vector3f::Zero(), first = Eigen::Vector3f::Zero();
      float count = 0, reach = 0;
      for (int v = cv * coarse.stride; v < (cv + 1) * coarse.stride; ++v)
        for (int u = cu * coarse.stride; u < (cu + 1) * coarse.stride; ++u) {
          const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u);
          if (popout.group[i] == 0) continue;
          const auto& p = grid.points[i];
          if (count == 0) {
            first = p;
            coarse.group[at] = popout.group[i];
            reach = 4 * static_cast<float>(coarse.stride) * grid.pitch * p.norm();
          } else if (popout.group[i] != coarse.group[at] || (p - first).squaredNorm() > reach * reach) {
            continue;
          }
          sum += p;
          ++count;
        }
      if (count > 0) coarse.points[at] = sum / count;
    }
}

/// Coordinates and groups column by column, with a frame of empty cells around, so that a whole row of neighbourhoods is summed at once.
struct CoarseColumns {
  static constexpr int kLanes = 8;  // cells side by side
  int width = 0;                    // of a row with its frame
  std::vector<float> x, y, z, group;

  explicit CoarseColumns(const CoarseGrid& coarse) {
    width = (coarse.width + kLanes - 1) / kLanes * kLanes + 2 * kNormalRadius;
    const auto cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(coarse.height + 2 * kNormalRadius);
    for (auto* column : {&x, &y, &z, &group}) column->assign(cells, 0.0f);
    for (int v = 0; v < coarse.height; ++v)
      for (int u = 0; u < coarse.width; ++u) {
        const auto from = static_cast<std::size_t>(v * coarse.width + u), to = static_cast<std::size_t>(at(u, v));
        if (coarse.group[from] == 0) continue;
        x[to] = coarse.points[from].x();
        y[to] = coarse.points[from].y();
        z[to] = coarse.points[from].z();
        group[to] = static_cast<float>(coarse.group[from]);
      }
  }
  int at(int u, int v) const { return (v + kNormalRadius) * width + u + kNormalRadius; }
};

/// Sums over neighbourhoods: of the differences to the middle, and of their products, component by component.
struct NeighbourSums {
  static constexpr int kCount = 10;
  float of[kCount][CoarseColumns::kLanes] = {};

  /// Of kLanes cells from (u, v) on.
  void add(const CoarseColumns& from, int u, int v, float reach_per_range) {
    constexpr int kLanes = CoarseColumns::kLanes;
    const auto middle = static_cast<std::size_t>(from.at(u, v));
    float reach[kLanes];
    for (int k = 0; k < kLanes; ++k) {
      const std::size_t i = middle + static_cast<std::size_t>(k);
      reach[k] = reach_per_range * reach_per_range * (from.x[i] * from.x[i] + from.y[i] * from.y[i] + from.z[i] * from.z[i]);
    }
    for (int dv = -kNormalRadius; dv <= kNormalRadius; ++dv)
      for (int du = -kNormalRadius; du <= kNormalRadius; ++du) {
        const float *x = &from.x[middle], *y = &from.y[middle], *z = &from.z[middle], *group = &from.group[middle];
        const int to = dv * from.width + du;
        for (int k = 0; k < kLanes; ++k) {
          const float dx = x[to + k] - x[k], dy = y[to + k] - y[k], dz = z[to + k] - z[k];
          const float near = dx * dx + dy * dy + dz * dz <= reach[k] ? 1.0f : 0.0f, same = group[to + k] == group[k] ? near : 0.0f;
          const float mx = same * dx, my = same * dy, mz = same * dz;
          of[0][k] += same;
          of[1][k] += mx, of[2][k] += my, of[3][k] += mz;
          of[4][k] += mx * dx, of[5][k] += mx * dy, of[6][k] += mx * dz;
          of[7][k] += my * dy, of[8][k] += my * dz, of[9][k] += mz * dz;
        }
      }
  }
};

void estimate_normals(const CoarseColumns& columns, int row, float pitch, CoarseGrid& coarse) {
  constexpr int kLanes = CoarseColumns::kLanes;
  const float reach = kNormalReach * kNormalRadius * static_cast<float>(coarse.stride) * pitch;  // for each metre of range
  for (int first = 0; first < coarse.width; first += kLanes) {
    const int last = std::min(coarse.width, first + kLanes);
    const auto start = static_cast<std::size_t>(row * coarse.width + first);
    if (std::all_of(&coarse.group[start], &coarse.group[start] + (last - first), [](std::uint16_t g) { return g == 0; })) continue;
    NeighbourSums sums;
    sums.add(columns, first, row, reach);
    for (int u = first; u < last; ++u) {
      const auto at = static_cast<std::size_t>(row * coarse.width + u);
      const auto of = [&](int sum) { return sums.of[sum][u - first]; };
      const float count = of(0);
      if (coarse.group[at] == 0 || count < kFewNeighbours) continue;
      const Eigen::Vector3f sum(of(1), of(2), of(3));
      Eigen::Matrix3f scatter;
      scatter << of(4), of(5), of(6), of(5), of(7), of(8), of(6), of(8), of(9);
      scatter -= sum * sum.transpose() / count;
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
      solver.computeDirect(scatter);
      const Eigen::Vector3f n = solver.eigenvectors().col(0);
      coarse.normals[at] = n.dot(coarse.points[at]) > 0 ? Eigen::Vector3f(-n) : n;
      coarse.variation[at] = std::max(0.0f, solver.eigenvalues()[0]) / std::max(1e-12f, scatter.trace());
    }
  }
}

/// By what the normals of a tenth of the cells, the flattest, differ from those of cells so far off that no point tells both.
float unsteadiness(const CoarseGrid& coarse) {
  constexpr std::size_t kApart = 2 * kNormalRadius + 1;
  constexpr double kShare = 0.1;
  constexpr std::size_t kTooFew = 64;  // to tell
  std::vector<float> differ;           // chords, squared
  const auto width = static_cast<std::size_t>(coarse.width), height = static_cast<std::size_t>(coarse.height);
  for (std::size_t v = 0; v + kApart < height; v += 2)
    for (std::size_t u = 0; u + kApart < width; u += 2) {
      const std::size_t at = v * width + u;
      if (coarse.group[at] == 0 || coarse.normals[at].squaredNorm() == 0) continue;
      for (const std::size_t to : {at + kApart, at + kApart * width})
        if (coarse.group[to] == coarse.group[at] && coarse.normals[to].squaredNorm() > 0)
          differ.push_back((coarse.normals[to] - coarse.normals[at]).squaredNorm());
    }
  if (differ.size() < kTooFew) return 0;
  const auto flattest = differ.begin() + static_cast<std::ptrdiff_t>(kShare * static_cast<double>(differ.size()));
  std::nth_element(differ.begin(), flattest, differ.end());
  return std::clamp((std::sqrt(*flattest) - kSteady) / (kUnsteady - kSteady), 0.0f, 1.0f);
}

/// Breadth first from `seed`, over cells whose normal agrees with the patch's.
void grow_one(const CoarseGrid& coarse, std::size_t seed, std::uint16_t mark, float pitch, Patches& patches,
              std::vector<std::uint32_t>& queue) {
  queue.assign(1, static_cast<std::uint32_t>(seed));
  patches.label[seed] = mark;
  const auto least_cosine = static_cast<float>(by_steadiness(coarse, kSameFace, kSameRoughFace));
  Eigen::Vector3f sum = coarse.normals[seed], mean = sum;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t at = queue[next];
    const int cu = static_cast<int>(at) % coarse.width, cv = static_cast<int>(at) / coarse.width;
    const float reach = 5 * coarse.footprint(at, pitch);
    for (int v = std::max(0, cv - 1); v <= std::min(coarse.height - 1, cv + 1); ++v)
      for (int u = std::max(0, cu - 1); u <= std::min(coarse.width - 1, cu + 1); ++u) {
        const auto to = static_cast<std::size_t>(v * coarse.width + u);
        if (patches.label[to] != 0 || coarse.group[to] != coarse.group[seed] || coarse.normals[to].dot(mean) < least_cosine) continue;
        if ((coarse.points[to] - coarse.points[at]).squaredNorm() > reach * reach) continue;
        patches.label[to] = mark;
        queue.push_back(static_cast<std::uint32_t>(to));
        sum += coarse.normals[to];
        mean = sum.normalized();
      }
  }
}

/// The flattest neighbourhoods first: a patch should start in the middle of a face. Digit by digit: the bits of floats >= 0 are in the
/// order of their values.
void sort_by_variation(const CoarseGrid& coarse, std::vector<std::uint32_t>& seeds) {
  constexpr int kBits = 11;
  constexpr std::uint32_t kMask = (1U << kBits) - 1;
  struct Keyed {
    std::uint32_t key, seed;
  };
  std::vector<Keyed> from(seeds.size()), to(seeds.size());
  for (std::size_t k = 0; k < seeds.size(); ++k) from[k] = {std::bit_cast<std::uint32_t>(coarse.variation[seeds[k]]), seeds[k]};
  for (int shift = 0; shift < 32; shift += kBits) {
    std::array<std::size_t, kMask + 2> first{};
    for (const Keyed& k : from) ++first[((k.key >> shift) & kMask) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const Keyed& k : from) to[first[(k.key >> shift) & kMask]++] = k;
    from.swap(to);
  }
  for (std::size_t k = 0; k < seeds.size(); ++k) seeds[k] = from[k].seed;
}

/// Cells of no patch, edges mostly, join the nearest patch of their group, ring by ring.
void absorb_rest(const CoarseGrid& coarse, Patches& patches) {
  std::vector<std::uint32_t> rest, still;
  for (std::size_t at = 0; at < coarse.group.size(); ++at)
    if (coarse.group[at] != 0 && patches.label[at] == 0) rest.push_back(static_cast<std::uint32_t>(at));
  std::vector<std::uint16_t> choice(rest.size());
  while (!rest.empty()) {
    choice.assign(rest.size(), 0);
    for (std::size_t k = 0; k < rest.size(); ++k) {
      const std::size_t at = rest[k];
      const int cu = static_cast<int>(at) % coarse.width, cv = static_cast<int>(at) / coarse.width;
      float nearest = std::numeric_limits<float>::max();
      for (int v = std::max(0, cv - 1); v <= std::min(coarse.height - 1, cv + 1); ++v)
        for (int u = std::max(0, cu - 1); u <= std::min(coarse.width - 1, cu + 1); ++u) {
          const auto to = static_cast<std::size_t>(v * coarse.width + u);
          if (patches.label[to] == 0 || coarse.group[to] != coarse.group[at]) continue;
          const float d = (coarse.points[to] - coarse.points[at]).squaredNorm();
          if (d < nearest) {
            nearest = d;
            choice[k] = patches.label[to];
          }
        }
    }
    still.clear();
    for (std::size_t k = 0; k < rest.size(); ++k) {
      if (choice[k] != 0)
        patches.label[rest[k]] = choice[k];
      else
        still.push_back(rest[k]);
    }
    if (still.size() == rest.size()) break;
    rest.swap(still);
  }
}

void describe(const CoarseGrid& coarse, Patches& patches) {
  for (std::size_t at = 0; at < patches.label.size(); ++at) {
    if (patches.label[at] == 0) continue;
    auto& patch = patches.list[patches.label[at] - 1u];
    patch.group = coarse.group[at];
    ++patch.cells;
    patch.centroid += coarse.points[at];
    patch.normal += coarse.normals[at];
    const auto width = static_cast<std::size_t>(coarse.width);
    patch.middle += Eigen::Vector2f(static_cast<float>(at % width), static_cast<float>(at / width));
  }
  for (auto& patch : patches.list) {
    if (patch.cells != 0) {
      patch.centroid /= static_cast<float>(patch.cells);
      patch.middle /= static_cast<float>(patch.cells);
    }
    if (patch.normal.squaredNorm() > 0) patch.normal.normalize();
  }
}

}  // namespace

CoarseGrid make_coarse_grid(const PointGrid& grid, const Popout& popout, int threads) {
  CoarseGrid coarse;
  coarse.stride = std::max(1, (grid.width + kCoarseWidth / 2) / kCoarseWidth);
  coarse.width = grid.width / coarse.stride;
  coarse.height = grid.height / coarse.stride;
  const auto cells = static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height);
  coarse.points.assign(cells, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  coarse.normals.assign(cells, Eigen::Vector3f::Zero());
  coarse.variation.assign(cells, 1);
  coarse.group.assign(cells, 0);
  common::in_parallel(coarse.height, kRowsAtOnce, threads, [&](int first, int last) { average_blocks(grid, popout, first, last, coarse); });
  const CoarseColumns columns(coarse);
  common::in_parallel(coarse.height, kRowsAtOnce, threads, [&](int first, int last) {
    for (int v = first; v < last; ++v) estimate_normals(columns, v, grid.pitch, coarse);
  });
  coarse.unsteady = unsteadiness(coarse);
  return coarse;
}

Patches grow_patches(const CoarseGrid& coarse, float pitch) {
  Patches patches;
  patches.label.assign(coarse.group.size(), 0);
  std::vector<std::uint32_t> seeds, queue;
  for (std::size_t at = 0; at < coarse.group.size(); ++at)
    if (coarse.group[at] != 0 && coarse.normals[at].squaredNorm() > 0) seeds.push_back(static_cast<std::uint32_t>(at));
  sort_by_variation(coarse, seeds);
  std::vector<std::uint8_t> tried(coarse.group.size(), 0);
  for (const auto seed : seeds) {
    if (patches.label[seed] != 0 || tried[seed] != 0 || patches.list.size() >= 65000) continue;
    grow_one(coarse, seed, static_cast<std::uint16_t>(patches.list.size() + 1), pitch, patches, queue);
    if (static_cast<double>(queue.size()) >= by_steadiness(coarse, kSmallPatch, kSmallRoughPatch)) {
      patches.list.emplace_back();
      continue;
    }
    for (const auto at : queue) patches.label[at] = 0;
    tried[seed] = 1;
  }
  absorb_rest(coarse, patches);
  // A group too small or too rough for any patch is one patch.
  for (std::size_t at = 0; at < coarse.group.size(); ++at) {
    if (coarse.group[at] == 0 || patches.label[at] != 0) continue;
    patches.list.emplace_back();
    const auto mark = static_cast<std::uint16_t>(patches.list.size());
    for (std::size_t to = at; to < coarse.group.size(); ++to)
      if (coarse.group[to] == coarse.group[at] && patches.label[to] == 0) patches.label[to] = mark;
  }
  describe(coarse, patches);
  return patches;
}

}  // namespace swarmfit::perception
