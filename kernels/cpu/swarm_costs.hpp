// The costs of a swarm over stored points: every residual, or only those that can matter (see docs/method.md).
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/cpu/point_store.hpp"
#include "kernels/cpu/tasks.hpp"
#include "kernels/pruning_pause.hpp"

namespace swarmfit::kernels::cpu {

/// A swarm in the frame of the stored points. All spans but `cutoffs`, which may be empty, are one a model.
struct CentredSwarm {
  ModelKind kind = ModelKind::plane;
  std::size_t count = 0;
  std::span<const float> coefficients;  ///< coefficient_count a model
  std::span<const char> finite;         ///< whether a model's coefficients are; else it costs +inf
  std::span<const float> cutoffs;
};

/// A few models of a swarm over all points, whose blocks are looked at before any point is touched. Keeps its memory from call to call.
class OpenGroup {
 public:
  /// Fills the costs; returns how many residuals were computed. The points' bounds are prepared, the form is exact.
  std::uint64_t evaluate(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                         std::span<float> costs);

 private:
  void bound(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, Loss loss);
  /// What blocks of one sort cost the models that are alive: stretch by stretch, in place of their bounds, as long as a model may still
  /// win.
  void add(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
           std::uint8_t Open::*blocks, double PartialBound::*least, std::span<float> costs);
  void add_stretch(const CpuKernels& kernels, const PointStore& points, const CentredSwarm& swarm, const Summing& summing,
                   std::uint8_t Open::*blocks, std::size_t stretch);
  /// Models whose bounds add up to their cutoff.
  void drop_lost(const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);

  std::vector<Open> open_;  ///< a tile and a model
  std::vector<float> slack_;
  std::vector<PartialBound> parts_;   ///< a stretch of tiles and a model
  std::vector<PartialBound> bounds_;  ///< a model: what is settled, and bounds of the rest
  std::vector<std::uint32_t> alive_;  ///< models whose cost may still be below the cutoff
  std::vector<float> coefficients_;   ///< of those alive
  Aligned<std::int32_t> lanes_;       ///< of those alive, kMaxLanes each
  std::vector<std::int64_t> units_;   ///< of those alive
  std::uint64_t touched_ = 0;
};

/// Works in the caller's crew, where the work is worth_sharing. By brute force tiles, or pieces of them, are taken in runs and models in
/// groups: each pair is a task. Where losses are summed in quanta each thread keeps sums of its own, else each run of tiles has some, which
/// are added up in a fixed order. With pruning a group of models is a task.
class SwarmCosts {
 public:
  SwarmCosts(const CpuKernels& kernels, bool pruning) : kernels_(kernels), pruning_(pruning) {}

  /// New points or caps: what was learnt about how pruning pays is void.
  void forget() noexcept {
    pause_.forget();
    least_ = std::numeric_limits<float>::infinity();
  }
  /// Fills costs; returns how many residuals were computed.
  std::uint64_t evaluate(PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs);

 private:
  bool prune_now(const PointStore& points, const CentredSwarm& swarm, const Summing& summing);
  void evaluate_all(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);
  void sum_units(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);
  void sum_values(const PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs);
  std::uint64_t evaluate_open(PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);

  const CpuKernels& kernels_;
  bool pruning_;
  PruningPause pause_;
  float least_ = std::numeric_limits<float>::infinity();  ///< cost of the model whose sides the bounds know

  /// One thread's in quanta, begun anew with each swarm. What another core wrote is slow to get at, so lanes are added up by the thread
  /// whose they are.
  struct alignas(64) Units {
    std::uint64_t swarm = 0;
    Aligned<std::int32_t> lanes;    ///< kMaxLanes a model
    std::vector<std::size_t> held;  ///< pieces of tiles that the lanes of a group of models hold, at its first
    Aligned<std::int64_t> units;    ///< a model
  };
  std::vector<Units> units_;             ///< a thread
  std::vector<Aligned<double>> values_;  ///< a run of tiles: floating point, a model
  std::vector<std::int64_t> total_units_;
  std::uint64_t swarm_ = 0;             ///< number of the present one
  std::vector<std::uint64_t> touched_;  ///< a group of models
};

}  // namespace swarmfit::kernels::cpu
