// Points as the CPU back end keeps them: finite ones only, centred in double, then float in columns, in blocks of neighbours, padded.
#pragma once

#include <array>
#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include "kernels/blocks.hpp"
#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/morton_order.hpp"

namespace swarmfit::kernels::cpu {

/// Of whole cache lines. What is freed goes back to the system where it is large; oneTBB's allocator would keep it.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kLine{128};
  LineAllocator() = default;
  template <class U>
  LineAllocator(const LineAllocator<U>&) noexcept {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kLine)); }
  void deallocate(T* p, std::size_t) noexcept { ::operator delete(p, kLine); }
  friend bool operator==(const LineAllocator&, const LineAllocator&) noexcept { return true; }
};

template <class T>
using Aligned = std::vector<T, LineAllocator<T>>;

/// Coordinates and caps in blocks, the last filled up with points that cost nothing.
struct Columns {
  std::array<Aligned<float>, kMaxDimension> columns;
  Aligned<float> caps;
  std::size_t points = 0, blocks = 0;

  std::size_t tiles() const noexcept { return (blocks + kTileBlocks - 1) / kTileBlocks; }
  TileView tile(int dimension, std::size_t index) const noexcept;
};

class PointStore {
 public:
  /// Runs inside the caller's crew, as all that follows. The points must be valid (check_points).
  void assign(const PointsView& points);
  /// Where the first cap of a kept point that is not finite, or negative, stands in the input.
  std::optional<std::size_t> bad_cap(std::span<const float> caps) const noexcept;
  /// One cap a point, in input order; size and values must be valid.
  void set_caps(std::span<const float> caps);
  /// How losses are to be summed under the caps.
  Summing summing(Loss loss) const noexcept;
  /// Brings bounds() up to date with the caps. Exact form of `summing` only.
  void prepare_bounds(const CpuKernels& kernels, const Summing& summing);
  /// Tells the bounds, which are up to date, on which side of a model each point is: tighter for models near it, valid for all.
  void take_sides(const CpuKernels& kernels, ModelKind kind, const float* coefficients);

  int dimension() const noexcept { return dimension_; }
  std::size_t count() const noexcept { return count_; }    ///< points given
  std::size_t finite() const noexcept { return finite_; }  ///< points kept
  std::size_t tiles() const noexcept { return all_.tiles(); }
  TileView tile(std::size_t index) const noexcept { return all_.tile(dimension_, index); }
  /// Points that may cost something: without those whose cap is 0, where these are many.
  std::size_t costly() const noexcept { return scored().points; }
  std::size_t costly_blocks() const noexcept { return scored().blocks; }
  std::size_t costly_tiles() const noexcept { return scored().tiles(); }
  TileView costly_tile(std::size_t index) const noexcept { return scored().tile(dimension_, index); }
  const TileBounds& bounds(std::size_t costly_tile) const noexcept { return bounds_[costly_tile]; }
  const double* centre() const noexcept { return centre_.data(); }
  /// Largest |coordinate| about the centre, a column.
  const std::array<float, kMaxDimension>& reach() const noexcept { return reach_; }
  /// Where the kept point at `position` stands in the input.
  std::size_t input_index(std::size_t position) const noexcept { return input_.empty() ? position : input_[position]; }

 private:
  struct Chunk {
    std::size_t finite = 0, start = 0;
    std::array<double, kMaxDimension> sum{};
    std::array<float, kMaxDimension> reach{};
  };

  void keep_finite(const PointsView& points, std::vector<Chunk>& chunks);
  void sort();
  void keep_costly();
  const Columns& scored() const noexcept { return apart_ ? costly_ : all_; }

  int dimension_ = 0;
  std::size_t count_ = 0;
  std::size_t finite_ = 0;
  std::array<double, kMaxDimension> centre_{};
  std::array<float, kMaxDimension> reach_{};
  Columns all_, costly_;
  bool apart_ = false;  ///< whether the costly points are in `costly_`
  float most_cap_ = 0;
  std::vector<std::uint32_t> input_;   ///< empty where it would be the identity
  std::vector<std::uint32_t> places_;  ///< of those of costly_, in all_
  MortonOrder morton_;
  Aligned<float> unsorted_;  ///< what sorting leaves is kept for the next cloud, unless that is large
  std::vector<std::uint32_t> order_;
  Aligned<TileBounds> bounds_;
  bool bounds_current_ = false;
  Summing bounds_summing_;
};

}  // namespace swarmfit::kernels::cpu
