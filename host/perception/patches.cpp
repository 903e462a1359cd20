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

void estimate_normal(CoarseGrid& coarse, int cu, int cv, float pitch) {
  const auto at = static_cast<std::size_t>(cv * coarse.width + cu);
  const auto& p = coarse.points[at];
  const float reach = kNormalReach * kNormalRadius * coarse.footprint(at, pitch);
  // Sums of the differences and of their products, component by component.
  float count = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  const int first = std::max(0, cu - kNormalRadius), last = std::min(coarse.width - 1, cu + kNormalRadius);
  for (int v = std::max(0, cv - kNormalRadius); v <= std::min(coarse.height - 1, cv + kNormalRadius); ++v)
    for (int u = first; u <= last; ++u) {
      const auto to = static_cast<std::size_t>(v * coarse.width + u);
      const Eigen::Vector3f d = coarse.points[to] - p;
      if (coarse.group[to] != coarse.group[at] || d.squaredNorm() > reach * reach) continue;
      ++count;
      x += d.x(), y += d.y(), z += d.z();
      xx += d.x() * d.x(), xy += d.x() * d.y(), xz += d.x() * d.z();
      yy += d.y() * d.y(), yz += d.y() * d.z(), zz += d.z() * d.z();
    }
  if (count < kFewNeighbours) return;
  const Eigen::Vector3f sum(x, y, z);
  Eigen::Matrix3f scatter;
  scatter << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  scatter -= sum * sum.transpose() / count;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(scatter);
  Eigen::Vector3f n = solver.eigenvectors().col(0);
  if (n.dot(p) > 0) n = -n;
  coarse.normals[at] = n;
  coarse.variation[at] = std::max(0.0f, solver.eigenvalues()[0]) / std::max(1e-12f, scatter.trace());
}

/// By what the normals of a tenth of the cells, the flattest, differ from those of cells so far off that no point tells both.
float unsteadiness(const CoarseGrid& coarse) {
  constexpr std::size_t kApart = 2 * kNormalRadius + 1;
  constexpr double kShare = 0.1;
  std::vector<float> differ;  // chords, squared
  const auto width = static_cast<std::size_t>(coarse.width), height = static_cast<std::size_t>(coarse.height);
  for (std::size_t v = 0; v + kApart < height; v += 2)
    for (std::size_t u = 0; u + kApart < width; u += 2) {
      const std::size_t at = v * width + u;
      if (coarse.group[at] == 0 || coarse.normals[at].squaredNorm() == 0) continue;
      for (const std::size_t to : {at + kApart, at + kApart * width})
        if (coarse.group[to] == coarse.group[at] && coarse.normals[to].squaredNorm() > 0)
          differ.push_back((coarse.normals[to] - coarse.normals[at]).squaredNorm());
    }
  if (differ.size() < 64) return 0;
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
  common::in_parallel(coarse.height, kRowsAtOnce, threads, [&](int first, int last) {
    for (int v = first; v < last; ++v)
      for (int u = 0; u < coarse.width; ++u)
        if (coarse.group[static_cast<std::size_t>(v * coarse.width + u)] != 0) estimate_normal(coarse, u, v, grid.pitch);
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
