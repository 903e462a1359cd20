// The points as the algorithms see them: centred and scaled, so that numbers are near 1 whatever the data's unit and origin.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/points.hpp>

#include "kernels/points_view.hpp"

namespace swarmfit::models {

inline constexpr int kMaxDimension = 4;

/// working = (data - centre) / scale, one scale for all columns.
struct Frame {
  std::array<double, kMaxDimension> centre{};
  double scale = 1;
};

kernels::PointsView to_kernel(const PointsView& points) noexcept;

/// A cloud with its frame and the list of its finite points. Owns no coordinates.
class WorkingPoints {
 public:
  WorkingPoints() = default;
  /// Looks at every point once. The centre is the mean of the finite points, the scale their root mean square distance from it.
  explicit WorkingPoints(const PointsView& points);

  int dimension() const noexcept { return view_.dimension; }
  std::size_t size() const noexcept { return view_.count; }
  std::size_t finite_count() const noexcept { return finite_count_; }
  bool finite(std::size_t i) const noexcept { return finite_.empty() || finite_[i] != 0; }
  /// Input index of the k-th finite point.
  std::uint32_t finite_index(std::size_t k) const noexcept { return index_.empty() ? static_cast<std::uint32_t>(k) : index_[k]; }
  const Frame& frame() const noexcept { return frame_; }
  /// Dimension of the smallest flat that holds all finite points (to float precision): 0 a point, 1 a line, 2 a plane ...
  int rank() const noexcept { return rank_; }
  const kernels::PointsView& view() const noexcept { return view_; }
  double at(std::size_t i, int d) const noexcept {
    return (view_.at(i, d) - frame_.centre[static_cast<std::size_t>(d)]) / frame_.scale;
  }
  template <int D>
  Eigen::Matrix<double, D, 1> point(std::size_t i) const noexcept {
    Eigen::Matrix<double, D, 1> p;
    for (int d = 0; d < D; ++d) p[d] = at(i, d);
    return p;
  }

 private:
  void describe(const Eigen::Vector4d& origin, const Eigen::Vector4d& mean, const Eigen::Matrix4d& square);

  kernels::PointsView view_;
  Frame frame_;
  std::size_t finite_count_ = 0;
  int rank_ = 0;
  std::vector<std::uint8_t> finite_;   // empty: all are
  std::vector<std::uint32_t> index_;   // empty: the identity
};

}  // namespace swarmfit::models
