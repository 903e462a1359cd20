// The inner loops of the CPU back end, one table of functions for each instruction set the build knows (cpu_kernels.cpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/blocks.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::kernels::cpu {

/// Blocks per tile: a tile's coordinates and caps stay in the first-level cache while a group of models passes over them, and a byte
/// holds one bit for each of its blocks.
inline constexpr std::size_t kTileBlocks = 8;
inline constexpr std::size_t kTilePoints = kBlockPoints * kTileBlocks;
/// Most lanes of any vector.
inline constexpr std::size_t kMaxLanes = 16;
/// Models whose partial sums are kept side by side while they pass over a tile.
inline constexpr std::size_t kGroupModels = 128;

/// Columns of points, aligned to a cache line, and their caps: where a tile starts.
struct TileView {
  const float* columns[kMaxDimension] = {};
  const float* caps = nullptr;
  std::size_t blocks = 0;
};

/// How losses are summed. Exact: `scale` quanta a unit of cost, a power of two; a block's lane sums are rounded to whole ones, so that sums
/// over blocks may be taken in any order, and by any number of threads, with the same outcome. A block's losses stay below 2^27 quanta.
/// Where caps are so much larger than the cloud that quanta would be too coarse, `scale` is 0, and floating point is added up in a fixed
/// order.
struct Summing {
  Loss loss = Loss::truncated_l1;
  float scale = 0;
};

/// Where the fields of BlockBounds lie in TileBounds.
struct Field {
  static constexpr std::size_t count = 0, least_cap = 1, most_cap = 2, cap_sum = 3, mean = 4, axis = 7, spread = 16, signed_offset = 19,
                               sign_sum = 28, radius = 31, mean_square = 32, side_offset = 33, side_sum = 36, all = 37;
};

/// Bounds of a tile's blocks side by side. Blocks that are not there are beyond every model's reach and cost nothing. `side_offset` and
/// `side_sum` are one more set of signs as BlockBounds has them: on which side of the best model so far each point is, 0 before there is
/// one.
struct TileBounds {
  alignas(64) float field[Field::all][kTileBlocks];
  alignas(64) std::int32_t cap_units[kTileBlocks];  ///< cost of a block whose points are all beyond their caps
  /// A ball about all of it, the largest cap in it, and the sum of cap_units: of a tile that is out of reach no block is looked at.
  float ball[kMaxDimension] = {};
  float ball_radius = 0;
  float ball_cap = -std::numeric_limits<float>::infinity();
  std::int64_t all_cap_units = 0;
};

/// What is known of a model over part of the cloud before any point is touched.
struct PartialBound {
  std::int64_t settled = 0;  ///< quanta of blocks beyond the caps
  double within = 0;         ///< lower bound over blocks that lie within the caps
  double mixed = 0;          ///< lower bound over the others
};

/// A model's blocks of a tile that must be looked at, a bit each.
struct Open {
  std::uint8_t within = 0;
  std::uint8_t mixed = 0;
};

/// Points that a pass over the caller's memory takes at a time.
inline constexpr std::size_t kStripPoints = 1024;

/// A strip of rows in columns, about a pivot among them. `limit` is what a distance may be; less than 0 for rows that are not finite,
/// whose columns are 0, and for those that fill the strip up to a whole number of the widest vectors.
struct Strip {
  alignas(64) std::array<std::array<float, kStripPoints>, kMaxDimension> columns;
  alignas(64) std::array<float, kStripPoints> limit;
  std::size_t count = 0;  ///< rows of the caller that are in it
};

/// Sums over a strip, about its pivot.
struct StripSums {
  double count = 0, weight = 0, square = 0, cost = 0;
  std::array<double, kMaxDimension> first{};                              ///< sum of w x
  std::array<std::array<double, kMaxDimension>, kMaxDimension> second{};  ///< sum of w x x^T, the upper triangle
};

struct CpuKernels {
  const char* name;
  std::size_t lanes;

  /// values[j] += the losses of the tile's points to model j, for at most kGroupModels models with `coefficients` row after row, in
  /// floating point. A model's sum does not depend on the others.
  void (*add_values)(ModelKind kind, Loss loss, const TileView& tile, const float* coefficients, std::size_t models, double* values);

  /// The same in quanta, in lanes: kMaxLanes numbers a model, on a cache line. `blocks`: null for all, else a bit a block for each model.
  /// Lanes hold what `lanes` tiles cost.
  void (*add_units)(ModelKind kind, const Summing& summing, const TileView& tile, const float* coefficients, std::size_t models,
                    const std::uint8_t* blocks, std::int32_t* lane_units);

  /// units[j] += model j's lanes, which are 0 thereafter.
  void (*settle_units)(std::int32_t* lane_units, std::size_t models, std::int64_t* units);

  /// Quanta of each block of the tile for a model that explains none of its points; exact form only.
  void (*cap_units)(const Summing& summing, const TileView& tile, std::int32_t* units);

  /// `columns` and `caps` start at the block, on a cache line, and hold kBlockPoints values; `dimension` is 2 or 3.
  void (*bound_block)(const float* const* columns, const float* caps, int dimension, BlockBounds& bounds);

  /// Bounds of models of a bounded kind over a tile. slack[j] is what rounding may do to a distance of model j.
  void (*bound)(ModelKind kind, Loss loss, const TileBounds& tile, const float* coefficients, const float* slack, std::size_t models,
                Open* open, PartialBound* bounds);

  /// Which side of the model each point is on, into the bounds of its tile.
  void (*take_sides)(ModelKind kind, const TileView& tile, const float* coefficients, TileBounds& bounds);

  /// |dist| of the tile's points to one model.
  void (*distances)(ModelKind kind, const TileView& tile, const float* coefficients, float* out);

  /// Where distances[i] < nearest[i] and <= tolerance[i]: nearest[i] = distances[i], labels[i] = label.
  void (*keep_nearest)(const float* distances, const float* tolerance, std::size_t count, std::uint16_t label, float* nearest,
                       std::uint16_t* labels);

  /// Fills a strip from place `at` on, a multiple of 64, which is then its end, from `count` tight rows of `dimension` columns, less the
  /// pivot. Those that are finite get `limit`, or their cap where `caps` is not null, and a bit in the words of `finite`.
  void (*split)(const float* rows, std::size_t dimension, std::size_t count, const float* pivot, float limit, const float* caps,
                std::size_t at, Strip& strip, std::uint64_t* finite);

  /// Tight rows of `dimension` doubles, less the pivot, as floats: finite stays finite, anything else becomes NaN.
  void (*narrow)(const double* rows, std::size_t dimension, std::size_t count, const double* pivot, float* out);

  /// Of `count` tight rows, at most kStripPoints, less the pivot: which are finite, and their sums, each with weight 1.
  using Look = void (*)(const float* rows, std::size_t dimension, std::size_t count, const float* pivot, StripSums& sums,
                        std::uint64_t* finite);
  Look survey;
  /// The sums in double, so that the moments tell a plane from a line.
  Look survey_exactly;

  /// |dist| of each point; NaN for those that are not finite.
  void (*tell)(ModelKind kind, const Strip& strip, const float* coefficients, float* distances);

  /// Of the points within the tolerance and their limit; see Weighing. `distances` may be null.
  void (*weigh)(ModelKind kind, const Strip& strip, const float* coefficients, float tolerance, float corner, StripSums& sums,
                float* distances);

  /// Before models claim a strip's points: nearest[i] is just beyond the limit of those that are finite and -1 for others, labels[i] = 0.
  void (*begin_claim)(const Strip& strip, float* nearest, std::int32_t* labels);

  /// Where the distance is less than nearest[i]: nearest[i] is that, labels[i] = label. Adds to the cost; true if there was any such point.
  bool (*claim)(ModelKind kind, const Strip& strip, const float* coefficients, std::int32_t label, float* nearest, std::int32_t* labels,
                double& cost);

  /// After they did: `count` of the labels, as they are given out.
  void (*end_claim)(const std::int32_t* labels, std::size_t count, std::uint16_t* out);

  /// Of the points with this label, each with weight 1.
  void (*sum_labelled)(const Strip& strip, std::size_t dimension, std::int32_t label, const float* nearest, const std::int32_t* labels,
                       StripSums& sums);

  /// Runs `rounds` rounds of independent multiply-adds that stay in registers; returns how many scalar ones that were.
  double (*spin_fma)(std::size_t rounds, float* sink);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const CpuKernels*>& available_kernels();

/// Bounds of one block into its place.
void pack_bounds(const BlockBounds& block, std::size_t at, TileBounds& tile);
/// The ball, of blocks and units that are in their places.
void wrap_bounds(int dimension, TileBounds& tile);

}  // namespace swarmfit::kernels::cpu
