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

/// body(first, last) for runs of `count` places.
template <class Body>
void for_runs(std::size_t count, kernels::FitnessEvaluator* workers, Body&& body) {
  constexpr std::size_t kRun = 64, kWorthWaking = 1024;
  if (workers == nullptr || count <= kWorthWaking) return body(std::size_t{0}, count);
  workers->share_out((count + kRun - 1) / kRun, [&](std::size_t run) { body(run * kRun, std::min(count, (run + 1) * kRun)); });
}

}  // namespace

Neighbours::Neighbours(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::size_t count,
                       kernels::FitnessEvaluator* workers) {
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
  for_runs(candidates.size(), workers, [&](std::size_t first, std::size_t last) {
    std::vector<std::uint32_t> place(count_ + 1);
    std::vector<float> square(count_ + 1);
    std::vector<std::pair<float, std::uint32_t>> sorted;
    for (std::size_t c = first; c < last; ++c) {
      const std::size_t found = tree.knnSearch(&rows.values[c * rows.columns], count_ + 1, place.data(), square.data());
      sorted.clear();
      for (std::size_t k = 0; k < found; ++k) {
        if (place[k] != c) sorted.emplace_back(square[k], place[k]);
      }
      std::sort(sorted.begin(), sorted.end());  // many duplicates may have crowded the point itself out of its own list
      for (std::size_t k = 0; k < count_; ++k) nearest_[c * count_ + k] = sorted[k].second;
    }
  });
}

std::vector<Eigen::Vector3f> estimate_normals(const WorkingPoints& points, std::span<const std::uint32_t> candidates,
                                              const Neighbours& neighbours, kernels::FitnessEvaluator* workers) {
  std::vector<Eigen::Vector3f> normals(candidates.size(), Eigen::Vector3f::Zero());
  if (neighbours.empty()) return normals;
  for_runs(candidates.size(), workers, [&](std::size_t first, std::size_t last) {
    for (std::size_t c = first; c < last; ++c) normals[c] = normal_of(points, candidates, candidates[c], neighbours.of(c));
  });
  return normals;
}

}  // namespace swarmfit::models
