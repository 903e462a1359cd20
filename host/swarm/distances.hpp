// Distances of several models to the same points.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// One row a model, one value a point; all in one piece of memory.
class Distances {
 public:
  Distances() = default;
  Distances(std::size_t rows, std::size_t points) : points_(points), values_(rows * points) {}

  std::size_t rows() const noexcept { return points_ > 0 ? values_.size() / points_ : 0; }
  std::span<float> operator[](std::size_t row) noexcept { return std::span(values_).subspan(row * points_, points_); }
  std::span<const float> operator[](std::size_t row) const noexcept { return std::span(values_).subspan(row * points_, points_); }
  std::span<float> all() noexcept { return values_; }

  /// `row` has a value for each point, and is none of these.
  void add(std::span<const float> row) {
    points_ = row.size();
    values_.insert(values_.end(), row.begin(), row.end());
  }
  void set(std::size_t at, std::span<const float> row) { std::copy(row.begin(), row.end(), (*this)[at].begin()); }
  void remove(std::size_t row) {
    const auto first = values_.begin() + static_cast<std::ptrdiff_t>(row * points_);
    values_.erase(first, first + static_cast<std::ptrdiff_t>(points_));
  }

 private:
  std::size_t points_ = 0;
  kernels::Reused<float> values_;
};

}  // namespace swarmfit::swarm
