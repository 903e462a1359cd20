#include "host/perception/stereo_normals.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "host/common/parallel.hpp"

namespace swarmfit::perception {
namespace {

constexpr int kReach = 5;            // [cells] of the window, to each side
constexpr double kSeen = 0.4;        // of the window's cells have something to match
constexpr double kResidual = 0.004;  // [1 / m] rms of the inverse range: more is no one plane
constexpr int kRowsAtOnce = 16;      // of cells, that one thread works on

/// Sums over cells with ray r and inverse range q, of which q = m . r is solved for m by least squares.
struct Moments {
  Eigen::Matrix3d rays = Eigen::Matrix3d::Zero();   // r r^T
  Eigen::Vector3d along = Eigen::Vector3d::Zero();  // r q
  double square = 0, count = 0;                     // q^2, 1

  void add(const Moments& other, double sign) {
    rays += sign * other.rays;
    along += sign * other.along;
    square += sign * other.square;
    count += sign * other.count;
  }
};

Moments of_cell(const Eigen::Vector3f& point) {
  const double range = static_cast<double>(point.norm()), q = 1 / range;
  const Eigen::Vector3d ray = point.cast<double>() * q;
  return {ray * ray.transpose(), ray * q, q * q, 1};
}

/// Sums over each row's cells within kReach columns.
void sum_row(const PointGrid& cells, std::span<const std::uint8_t> textured, int row, std::vector<Moments>& sums) {
  const auto width = static_cast<std::size_t>(cells.width), first = static_cast<std::size_t>(row) * width;
  std::vector<Moments> own(width);
  for (std::size_t u = 0; u < width; ++u) {
    const auto& p = cells.points[first + u];
    if (PointGrid::seen(p) && textured[first + u] != 0 && p.squaredNorm() > 0) own[u] = of_cell(p);
  }
  for (std::size_t u = 0; u < width; ++u) {
    Moments& sum = sums[first + u];
    for (std::size_t k = u - std::min<std::size_t>(u, kReach); k <= std::min(width - 1, u + kReach); ++k) sum.add(own[k], 1);
  }
}

Eigen::Vector3f solve(const Moments& sum, const Eigen::Vector3f& point) {
  constexpr double kCells = (2 * kReach + 1) * (2 * kReach + 1);
  if (sum.count < kSeen * kCells || !PointGrid::seen(point)) return Eigen::Vector3f::Zero();
  const Eigen::Vector3d m = sum.rays.inverse() * sum.along;
  const double variance = std::max(0.0, sum.square - m.dot(sum.along)) / sum.count;
  if (!(variance < kResidual * kResidual)) return Eigen::Vector3f::Zero();
  return (-m).normalized().cast<float>();  // m . p = 1: m points away from the camera
}

}  // namespace

std::vector<Eigen::Vector3f> stereo_normals(const PointGrid& cells, std::span<const std::uint8_t> textured, int threads) {
  std::vector<Eigen::Vector3f> normals(cells.size(), Eigen::Vector3f::Zero());
  std::vector<Moments> rows(cells.size());
  common::in_parallel(cells.height, kRowsAtOnce, threads, [&](int first, int last) {
    for (int v = first; v < last; ++v) sum_row(cells, textured, v, rows);
  });
  common::in_parallel(cells.height, kRowsAtOnce, threads, [&](int first, int last) {
    const auto width = static_cast<std::size_t>(cells.width);
    for (int v = first; v < last; ++v)
      for (std::size_t u = 0; u < width; ++u) {
        Moments sum;
        for (int k = std::max(0, v - kReach); k <= std::min(cells.height - 1, v + kReach); ++k)
          sum.add(rows[static_cast<std::size_t>(k) * width + u], 1);
        const auto at = static_cast<std::size_t>(v) * width + u;
        normals[at] = solve(sum, cells.points[at]);
      }
  });
  return normals;
}

}  // namespace swarmfit::perception
