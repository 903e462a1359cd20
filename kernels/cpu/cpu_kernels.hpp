// The inner loops of the CPU back end, one table of functions for each instruction set the build knows (cpu_kernels.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::kernels::cpu {

/// Points per block: the unit in which costs are summed, and the least that is ever skipped. A multiple of every vector's lanes.
inline constexpr std::size_t kBlockPoints = 256;
/// Blocks per tile: a tile's coordinates and caps stay in the first-level cache while a group of models passes over them.
inline constexpr std::size_t kTileBlocks = 8;
inline constexpr std::size_t kTilePoints = kBlockPoints * kTileBlocks;
/// Most lanes of any vector.
inline constexpr std::size_t kMaxLanes = 16;
/// Models whose partial sums are kept side by side while they pass over a tile.
inline constexpr std::size_t kGroupModels = 32;

/// Columns of points, aligned to a cache line, and their caps: where a tile starts.
struct TileView {
  const float* columns[kMaxDimension] = {};
  const float* caps = nullptr;
  std::size_t blocks = 0;
};

struct CpuKernels {
  const char* name;
  std::size_t lanes;

  /// costs[j] += sum of the losses of the tile's points to model j, for at most kGroupModels models with `coefficients` row after row.
  /// A model's sum does not depend on the others.
  void (*add_costs)(ModelKind kind, Loss loss, const TileView& tile, const float* coefficients, std::size_t models, double* costs);

  /// |dist| of the tile's points to one model.
  void (*distances)(ModelKind kind, const TileView& tile, const float* coefficients, float* out);

  /// Where distances[i] < nearest[i] and <= tolerance[i]: nearest[i] = distances[i], labels[i] = label.
  void (*keep_nearest)(const float* distances, const float* tolerance, std::size_t count, std::uint16_t label, float* nearest,
                       std::uint16_t* labels);

  /// Runs `rounds` rounds of independent multiply-adds that stay in registers; returns how many scalar ones that were.
  double (*spin_fma)(std::size_t rounds, float* sink);
};

/// Best first: what this build knows and this processor can run. Never empty.
const std::vector<const CpuKernels*>& available_kernels();

}  // namespace swarmfit::kernels::cpu
