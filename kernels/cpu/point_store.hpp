// Points as the CPU back end keeps them: finite ones only, centred in double, then float in columns, padded to whole blocks.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <oneapi/tbb/cache_aligned_allocator.h>

#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::kernels::cpu {

using AlignedFloats = std::vector<float, tbb::cache_aligned_allocator<float>>;

class PointStore {
 public:
  /// Runs inside the caller's task arena. The points must be valid (check_points).
  void assign(const PointsView& points);
  /// One cap a point, in input order; size and values must be valid.
  void set_caps(std::span<const float> caps);

  int dimension() const noexcept { return dimension_; }
  std::size_t count() const noexcept { return count_; }      ///< points given
  std::size_t finite() const noexcept { return finite_; }    ///< points kept
  std::size_t tiles() const noexcept { return (blocks_ + kTileBlocks - 1) / kTileBlocks; }
  TileView tile(std::size_t index) const noexcept;
  const double* centre() const noexcept { return centre_.data(); }
  /// Where the kept point at `position` stands in the input.
  std::size_t input_index(std::size_t position) const noexcept { return input_.empty() ? position : input_[position]; }

 private:
  int dimension_ = 0;
  std::size_t count_ = 0;
  std::size_t finite_ = 0;
  std::size_t blocks_ = 0;
  std::array<double, kMaxDimension> centre_{};
  std::array<AlignedFloats, kMaxDimension> columns_;
  AlignedFloats caps_;
  std::vector<std::uint32_t> input_;  ///< empty where it would be the identity
};

}  // namespace swarmfit::kernels::cpu
