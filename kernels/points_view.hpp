// A view of N points of D columns, of float or double, with any stride. Owns nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace swarmfit::kernels {

enum class Scalar { float32, float64 };

/// Row i starts `stride` bytes after row i-1; its D scalars are adjacent. A point with a NaN or an infinity in any column
/// is "not finite": it takes part in nothing, but keeps its place in the input's order.
struct PointsView {
  const void* data = nullptr;
  Scalar scalar = Scalar::float32;
  int dimension = 0;       ///< columns: 2 (x, y), 3 (x, y, z) or 4 (x1, y1, x2, y2)
  std::size_t count = 0;   ///< rows
  std::size_t stride = 0;  ///< bytes from a row to the next
  bool ordered = false;    ///< neighbours in the list are neighbours in space, as in Morton order: nobody needs to sort them
  /// Where known, whether a row is finite: bit i % 64 of word i / 64, as Survey has it. Passes then leave the holes of an image out.
  const std::uint64_t* finite_rows = nullptr;

  double at(std::size_t row, int column) const noexcept {
    const char* p = static_cast<const char*>(data) + row * stride;
    if (scalar == Scalar::float32) {
      float v;
      std::memcpy(&v, p + sizeof(float) * static_cast<std::size_t>(column), sizeof v);
      return v;
    }
    double v;
    std::memcpy(&v, p + sizeof(double) * static_cast<std::size_t>(column), sizeof v);
    return v;
  }
  bool finite(std::size_t row) const noexcept;
  /// So many rows from `first` on, which must be a multiple of 64 where it is known which rows are finite.
  PointsView rows(std::size_t first, std::size_t number) const noexcept {
    PointsView part = *this;
    part.data = static_cast<const char*>(data) + first * stride;
    part.count = number;
    if (finite_rows != nullptr) part.finite_rows += first / 64;
    return part;
  }
};

}  // namespace swarmfit::kernels
