// The costs of a swarm over stored points: every residual, or only those that can matter (see docs/method.md).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/cpu/point_store.hpp"
#include "kernels/cpu/tasks.hpp"

namespace swarmfit::kernels::cpu {

/// A swarm in the frame of the stored points. All spans but `cutoffs`, which may be empty, are one a model.
struct CentredSwarm {
  ModelKind kind = ModelKind::plane;
  std::size_t count = 0;
  std::span<const float> coefficients;  ///< coefficient_count a model
  std::span<const char> finite;         ///< whether a model's coefficients are; else it costs +inf
  std::span<const float> cutoffs;
};

/// Works in the caller's crew, where the work is worth_sharing. Tiles are taken in runs and models in groups: each pair is a task and
/// writes its own partial sums, which are added up in a fixed order.
class SwarmCosts {
 public:
  SwarmCosts(const CpuKernels& kernels, bool pruning) : kernels_(kernels), pruning_(pruning) {}

  /// New points or caps: what was learnt about how pruning pays is void.
  void forget() noexcept;
  /// Fills costs; returns how many residuals were computed.
  std::uint64_t evaluate(PointStore& points, const CentredSwarm& swarm, Loss loss, std::span<float> costs);

 private:
  bool prune_now(const PointStore& points, const CentredSwarm& swarm, const Summing& summing);
  std::uint64_t evaluate_all(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);
  std::uint64_t evaluate_open(PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::span<float> costs);
  void bound_all(const PointStore& points, const CentredSwarm& swarm, Loss loss);
  std::uint64_t add_open(const PointStore& points, const CentredSwarm& swarm, const Summing& summing, std::uint8_t Open::*blocks);

  const CpuKernels& kernels_;
  bool pruning_;
  int pause_ = 0;  ///< evaluations to go before pruning is tried again
  int last_pause_ = 0;

  std::vector<PartialCost> partial_;  ///< a run of tiles and a model
  std::vector<PartialBound> bounds_;  ///< a run of tiles and a model
  std::vector<Open> open_;            ///< a tile and a model
  std::vector<float> slack_;
  std::vector<std::uint32_t> alive_;  ///< models whose cost may still be below the cutoff
  std::vector<float> alive_coefficients_;
  std::vector<double> bound_within_, bound_mixed_;  ///< a model
  std::vector<std::int64_t> units_;                 ///< a model: quanta known exactly
  std::vector<std::uint64_t> touched_;              ///< a task
};

}  // namespace swarmfit::kernels::cpu
