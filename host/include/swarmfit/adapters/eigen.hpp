// Eigen's matrices, maps and blocks, and vectors of its points, as views of points. Nothing is copied.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/points.hpp>

namespace swarmfit::adapters {

template <class Scalar>
constexpr PointsView::Scalar scalar_of() {
  static_assert(std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>, "points are of float or double");
  return std::is_same_v<Scalar, float> ? PointsView::Scalar::float32 : PointsView::Scalar::float64;
}

/// One point a column: Matrix3Xf, Map<const Matrix3Xd, 0, OuterStride<>>, a block of columns ...
template <class Derived>
PointsView view_columns(const Eigen::DenseBase<Derived>& matrix) {
  static_assert((Derived::Flags & Eigen::DirectAccessBit) != 0, "an expression has no memory to look at: evaluate it first");
  static_assert(!Derived::IsRowMajor && Derived::InnerStrideAtCompileTime == 1, "a point's coordinates must be adjacent");
  using Scalar = typename Derived::Scalar;
  const Derived& m = matrix.derived();
  return {m.data(), scalar_of<Scalar>(), static_cast<int>(m.rows()), static_cast<std::size_t>(m.cols()),
          sizeof(Scalar) * static_cast<std::size_t>(m.outerStride())};
}

/// One point a row: Matrix<float, Dynamic, 3, RowMajor>, a map of such, a block of rows ...
template <class Derived>
PointsView view_rows(const Eigen::DenseBase<Derived>& matrix) {
  static_assert((Derived::Flags & Eigen::DirectAccessBit) != 0, "an expression has no memory to look at: evaluate it first");
  static_assert(Derived::IsRowMajor && Derived::InnerStrideAtCompileTime == 1, "a point's coordinates must be adjacent: use RowMajor");
  using Scalar = typename Derived::Scalar;
  const Derived& m = matrix.derived();
  return {m.data(), scalar_of<Scalar>(), static_cast<int>(m.cols()), static_cast<std::size_t>(m.rows()),
          sizeof(Scalar) * static_cast<std::size_t>(m.outerStride())};
}

/// std::vector<Eigen::Vector3f> and its likes.
template <class Scalar, int Dimension, int Options, class Allocator>
PointsView view(const std::vector<Eigen::Matrix<Scalar, Dimension, 1, Options>, Allocator>& points) {
  static_assert(Dimension > 0, "points of fixed size");
  using Point = Eigen::Matrix<Scalar, Dimension, 1, Options>;
  return {points.empty() ? nullptr : points.front().data(), scalar_of<Scalar>(), Dimension, points.size(), sizeof(Point)};
}

}  // namespace swarmfit::adapters
