// The points as the algorithms see them: centred and scaled, so that numbers are near 1 whatever the data's unit and origin.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/points.hpp>

#include "kernels/evidence.hpp"
#include "kernels/points_view.hpp"

namespace swarmfit::models {

inline constexpr int kMaxDimension = 4;

/// working = (data - centre) / scale, one scale for all columns.
struct Frame {
  std::array<double, kMaxDimension> centre{};
  double scale = 1;
};

kernels::PointsView to_kernel(const PointsView& points) noexcept;

/// Coordinates lie within this of 0: what the kernels square is a float.
inline constexpr double kFarthest = 1e18;
/// A coordinate that does not.
struct Stray {
  std::size_t point = 0;  ///< input index
  int column = 0;
  double value = 0;
};
/// The first one of a finite point, if there is one.
std::optional<Stray> find_stray(const kernels::PointsView& points);
/// Says which coordinate it is, what it is and what it must be.
std::string text_of(const Stray& stray);

/// Tells where finite points are in the input, in ascending order.
class FiniteWalk {
 public:
  /// Input index of the finite point at a place in [0, finite_count) among them, not below the place asked for before.
  std::uint32_t to(std::size_t place);

 private:
  friend class WorkingPoints;
  FiniteWalk(std::span<const std::uint64_t> finite, std::size_t here) : finite_(finite), here_(here) {}

  std::span<const std::uint64_t> finite_;
  std::size_t word_ = 0, before_ = 0, here_;  ///< finite points in the words before this one, and in it
};

/// A cloud with its frame. Owns no coordinates.
class WorkingPoints {
 public:
  WorkingPoints() = default;
  /// `survey` is that of the points. The centre is the mean of the finite points, the scale their root mean square distance from it.
  WorkingPoints(const PointsView& points, kernels::Survey survey);
  /// Looks at the points one after another.
  explicit WorkingPoints(const PointsView& points);

  int dimension() const noexcept { return view_.dimension; }
  std::size_t size() const noexcept { return view_.count; }
  std::size_t finite_count() const noexcept { return survey_.finite_count; }
  bool finite(std::size_t i) const noexcept { return ((survey_.finite[i / 64] >> (i % 64)) & 1U) != 0; }
  /// From finite point to finite point, the first of them at place 0.
  FiniteWalk walk() const;
  const Frame& frame() const noexcept { return frame_; }
  /// Dimension of the smallest flat that holds all finite points (to float precision): 0 a point, 1 a line, 2 a plane ...
  int rank() const noexcept { return rank_; }
  /// The first coordinate beyond kFarthest, if there is one; the frame means nothing then.
  std::optional<Stray> stray() const { return reach_ <= kFarthest / 8 ? std::nullopt : find_stray(view_); }
  /// Tells which rows are finite, out of this cloud's own memory.
  kernels::PointsView view() const noexcept {
    kernels::PointsView view = view_;
    view.finite_rows = survey_.finite.data();
    return view;
  }
  double at(std::size_t i, int d) const noexcept { return (view_.at(i, d) - frame_.centre[static_cast<std::size_t>(d)]) * per_scale_; }
  /// The point's columns, read at once.
  template <std::size_t D>
  std::array<double, D> row(std::size_t i) const noexcept {
    std::array<double, D> p;
    const char* const at = static_cast<const char*>(view_.data) + i * view_.stride;
    if (view_.scalar == kernels::Scalar::float64) {
      std::memcpy(p.data(), at, sizeof p);
    } else {
      std::array<float, D> narrow;
      std::memcpy(narrow.data(), at, sizeof narrow);
      for (std::size_t d = 0; d < D; ++d) p[d] = static_cast<double>(narrow[d]);
    }
    for (std::size_t d = 0; d < D; ++d) p[d] = (p[d] - frame_.centre[d]) * per_scale_;
    return p;
  }
  template <int D>
  Eigen::Matrix<double, D, 1> point(std::size_t i) const noexcept {
    return Eigen::Matrix<double, D, 1>(row<static_cast<std::size_t>(D)>(i).data());
  }

  /// Unit normals, one a point; those that are not known are zero. None are known until they are set.
  void set_normals(std::vector<Eigen::Vector3f> normals) noexcept { normals_ = std::move(normals); }
  bool has_normals() const noexcept { return !normals_.empty(); }
  Eigen::Vector3d normal(std::size_t i) const noexcept {
    return normals_.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(normals_[i].cast<double>());
  }

  /// Weighted sums over points of the working frame: total weight, sum w x, sum w x x^T. One pass, in index order.
  template <int D>
  void accumulate(std::span<const std::uint32_t> index, std::span<const double> weight, double& total, Eigen::Matrix<double, D, 1>& sum,
                  Eigen::Matrix<double, D, D>& square) const {
    if (view_.scalar == kernels::Scalar::float32) {
      accumulate_as<float, D>(index, weight, total, sum, square);
    } else {
      accumulate_as<double, D>(index, weight, total, sum, square);
    }
  }

 private:
  template <class T, int D>
  void accumulate_as(std::span<const std::uint32_t> index, std::span<const double> weight, double& total, Eigen::Matrix<double, D, 1>& sum,
                     Eigen::Matrix<double, D, D>& square) const {
    double w_all = 0, first[D] = {}, second[D][D] = {};
    for (std::size_t k = 0; k < index.size(); ++k) {
      T row[D];
      std::memcpy(row, static_cast<const char*>(view_.data) + index[k] * view_.stride, sizeof row);
      double x[D];
      for (int d = 0; d < D; ++d) x[d] = static_cast<double>(row[d]) - frame_.centre[static_cast<std::size_t>(d)];
      w_all += weight[k];
      for (int d = 0; d < D; ++d) {
        const double wx = weight[k] * x[d];
        first[d] += wx;
        for (int e = d; e < D; ++e) second[d][e] += wx * x[e];
      }
    }
    total = w_all;
    for (int d = 0; d < D; ++d) {
      sum[d] = first[d] / frame_.scale;
      for (int e = d; e < D; ++e) square(d, e) = square(e, d) = second[d][e] / (frame_.scale * frame_.scale);
    }
  }

  kernels::PointsView view_;
  kernels::Survey survey_;
  Frame frame_;
  double per_scale_ = 1;  ///< one over the frame's scale
  double reach_ = 0;      ///< about what the farthest coordinate is; a survey holds what it sums within kFarthest of a point nearby
  int rank_ = 0;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace swarmfit::models
