// A view of the caller's points. Owns nothing: the memory must outlive the call it is given to.
#pragma once

#include <cstddef>
#include <span>

#include <Eigen/Core>

namespace swarmfit {

/// N points of D columns, float or double, any stride in bytes. A point with NaN or infinity in a column keeps its place in the
/// input's order, takes part in nothing and gets label 0. Other coordinates must be in -1e18..1e18.
class PointsView {
 public:
  enum class Scalar { float32, float64 };

  PointsView() = default;
  /// Raw rows: row i starts at data + i * stride bytes, and its `dimension` scalars are adjacent.
  PointsView(const void* data, Scalar scalar, int dimension, std::size_t count, std::size_t stride)
      : data_(data), scalar_(scalar), dimension_(dimension), count_(count), stride_(stride) {}
  /// Tight rows: xyzxyz... for dimension 3.
  PointsView(std::span<const float> values, int dimension)
      : PointsView(values.data(), Scalar::float32, dimension, values.size() / static_cast<std::size_t>(dimension),
                   sizeof(float) * static_cast<std::size_t>(dimension)) {}
  PointsView(std::span<const double> values, int dimension)
      : PointsView(values.data(), Scalar::float64, dimension, values.size() / static_cast<std::size_t>(dimension),
                   sizeof(double) * static_cast<std::size_t>(dimension)) {}
  /// D x N in column order, one point a column: Eigen's own layout.
  template <int D>
  explicit PointsView(const Eigen::Matrix<float, D, Eigen::Dynamic>& columns)
      : PointsView(std::span<const float>(columns.data(), static_cast<std::size_t>(columns.size())), static_cast<int>(columns.rows())) {}
  template <int D>
  explicit PointsView(const Eigen::Matrix<double, D, Eigen::Dynamic>& columns)
      : PointsView(std::span<const double>(columns.data(), static_cast<std::size_t>(columns.size())), static_cast<int>(columns.rows())) {}

  const void* data() const noexcept { return data_; }
  Scalar scalar() const noexcept { return scalar_; }
  int dimension() const noexcept { return dimension_; }
  std::size_t size() const noexcept { return count_; }
  std::size_t stride() const noexcept { return stride_; }

 private:
  const void* data_ = nullptr;
  Scalar scalar_ = Scalar::float32;
  int dimension_ = 0;
  std::size_t count_ = 0;
  std::size_t stride_ = 0;
};

}  // namespace swarmfit
