#include "host/models/neighbours.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Dense>
#include <nanoflann.hpp>

#include "host/common/ranges.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::models {
namespace {

/// The candidates' coordinates as nanoflann asks for them.
template <std::size_t D>
struct Rows {
  kernels::Reused<float> values;

  std::size_t kdtree_get_point_count() const { return values.size() / D; }
  float kdtree_get_pt(std::size_t row, std::size_t column) const { return values[row * D + column]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

template <std::size_t D>
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Rows<D>>, Rows<D>, static_cast<int>(D), std::uint32_t>;

/// Of the plane through a point and its neighbours; zero where those have no one plane.
Eigen::Vector3f normal_of(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::uint32_t point,
                          std::span<const std::uint32_t> neighbours) {
  constexpr double kFlat = 0.5;  // of the next larger spread: above, the neighbourhood is no surface
  Eigen::Vector3d mean = points.point<3>(point);
  Eigen::Matrix3d square = mean * mean.transpose();
  for (const std::uint32_t n : neighbours) {
    const Eigen::Vector3d p = points.point<3>(candidates[n]);
    mean += p;
    square += p * p.transpose();
  }
  const double all = 1.0 + static_cast<double>(neighbours.size());
  mean /= all;
  const Eigen::Matrix3d scatter = square / all - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(scatter);
  const Eigen::Vector3d spread = solver.eigenvalues();
  if (!(spread[0] < kFlat * spread[1])) return Eigen::Vector3f::Zero();
  return solver.eigenvectors().col(0).cast<float>();
}

// Places that a thread takes at a time, and how many are not worth waking one for: a search takes a microsecond.
constexpr std::size_t kRun = 32, kFew = 128;

/// Places of the `count` candidates nearest to each, one after the other.
template <std::size_t D>
kernels::Reused<std::uint32_t> nearest_of_each(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::size_t count,
                                               kernels::FitnessEvaluator* workers, std::span<const std::uint8_t> asked) {
  constexpr std::size_t kLeaf = 24;  // points that are looked at one after the other
  Rows<D> rows;
  rows.values.reserve(candidates.size() * D);
  for (const std::uint32_t i : candidates) {
    for (const double x : points.row<D>(i)) rows.values.push_back(static_cast<float>(x));
  }
  const Tree<D> tree(static_cast<int>(D), rows, nanoflann::KDTreeSingleIndexAdaptorParams(kLeaf));
  kernels::Reused<std::uint32_t> nearest(candidates.size() * count);
  common::in_ranges(workers, candidates.size(), kRun, kFew, [&](std::size_t first, std::size_t last) {
    kernels::Reused<std::uint32_t> place(count + 1);
    kernels::Reused<float> square(count + 1);
    kernels::Reused<std::pair<float, std::uint32_t>> sorted;
    for (std::size_t c = first; c < last; ++c) {
      if (!asked.empty() && asked[c] == 0) {
        std::fill_n(nearest.begin() + static_cast<std::ptrdiff_t>(c * count), count, static_cast<std::uint32_t>(c));
        continue;
      }
      const std::size_t found = tree.knnSearch(&rows.values[c * D], count + 1, place.data(), square.data());
      sorted.clear();
      for (std::size_t k = 0; k < found; ++k) {
        if (place[k] != c) sorted.emplace_back(square[k], place[k]);
      }
      std::sort(sorted.begin(), sorted.end());  // many duplicates may have crowded the point itself out of its own list
      for (std::size_t k = 0; k < count; ++k) nearest[c * count + k] = sorted[k].second;
    }
  });
  return nearest;
}

}  // namespace

Neighbours::Neighbours(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::size_t count,
                       kernels::FitnessEvaluator* workers, std::span<const std::uint8_t> asked) {
  count_ = candidates.empty() ? 0 : std::min(count, candidates.size() - 1);
  if (count_ == 0) return;
  switch (points.dimension()) {
    case 2: nearest_ = nearest_of_each<2>(points, candidates, count_, workers, asked); return;
    case 3: nearest_ = nearest_of_each<3>(points, candidates, count_, workers, asked); return;
    default: nearest_ = nearest_of_each<4>(points, candidates, count_, workers, asked);
  }
}

std::vector<Eigen::Vector3f> estimate_normals(const WorkingPoints& points, std::span<const std::uint32_t> candidates,
                                              const Neighbours& neighbours, kernels::FitnessEvaluator* workers,
                                              std::span<const std::uint8_t> asked) {
  std::vector<Eigen::Vector3f> normals(candidates.size(), Eigen::Vector3f::Zero());
  if (neighbours.empty()) return normals;
  common::in_ranges(workers, candidates.size(), kRun, kFew, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c) {
      if (asked.empty() || asked[c] != 0) normals[c] = normal_of(points, candidates, candidates[c], neighbours.of(c));
    }
  });
  return normals;
}

}  // namespace swarmfit::models
