#include "host/models/neighbours.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Dense>
#include <nanoflann.hpp>

namespace swarmfit::models {
namespace {

/// The candidates' coordinates as nanoflann asks for them.
struct Rows {
  std::vector<float> values;
  std::size_t columns = 0;

  std::size_t kdtree_get_point_count() const { return columns == 0 ? 0 : values.size() / columns; }
  float kdtree_get_pt(std::size_t row, std::size_t column) const { return values[row * columns + column]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Rows>, Rows, -1, std::uint32_t>;

}  // namespace

Neighbours::Neighbours(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::size_t count) {
  count_ = candidates.empty() ? 0 : std::min(count, candidates.size() - 1);
  if (count_ == 0) return;
  Rows rows;
  rows.columns = static_cast<std::size_t>(points.dimension());
  rows.values.reserve(candidates.size() * rows.columns);
  for (const std::uint32_t i : candidates) {
    for (int d = 0; d < points.dimension(); ++d) rows.values.push_back(static_cast<float>(points.at(i, d)));
  }
  const Tree tree(points.dimension(), rows);
  nearest_.resize(candidates.size() * count_);
  std::vector<std::uint32_t> place(count_ + 1);
  std::vector<float> square(count_ + 1);
  std::vector<std::pair<float, std::uint32_t>> sorted;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const std::size_t found = tree.knnSearch(&rows.values[c * rows.columns], count_ + 1, place.data(), square.data());
    sorted.clear();
    for (std::size_t k = 0; k < found; ++k) {
      if (place[k] != c) sorted.emplace_back(square[k], place[k]);
    }
    std::sort(sorted.begin(), sorted.end());  // many duplicates may have crowded the point itself out of its own list
    for (std::size_t k = 0; k < count_; ++k) nearest_[c * count_ + k] = sorted[k].second;
  }
}

std::vector<Eigen::Vector3f> estimate_normals(const WorkingPoints& points, std::span<const std::uint32_t> candidates,
                                              const Neighbours& neighbours) {
  constexpr double kFlat = 0.5;  // of the next larger spread: above, the neighbourhood is no surface
  std::vector<Eigen::Vector3f> normals(candidates.size(), Eigen::Vector3f::Zero());
  if (neighbours.empty()) return normals;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    Eigen::Vector3d mean = points.point<3>(candidates[c]);
    Eigen::Matrix3d square = mean * mean.transpose();
    for (const std::uint32_t n : neighbours.of(c)) {
      const Eigen::Vector3d p = points.point<3>(candidates[n]);
      mean += p;
      square += p * p.transpose();
    }
    const double all = 1.0 + static_cast<double>(neighbours.count());
    mean /= all;
    const Eigen::Matrix3d scatter = square / all - mean * mean.transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(scatter);
    const Eigen::Vector3d spread = solver.eigenvalues();
    if (!(spread[0] < kFlat * spread[1])) continue;
    normals[c] = solver.eigenvectors().col(0).cast<float>();
  }
  return normals;
}

}  // namespace swarmfit::models
