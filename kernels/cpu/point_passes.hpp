// One pass over points where they lie in the caller's memory, strip by strip: nothing is copied, sorted or kept.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cpu/cpu_kernels.hpp"
#include "kernels/evidence.hpp"

namespace swarmfit::kernels::cpu {

/// Works in the caller's crew, on arguments that are valid (checks.hpp). Strips are taken in runs of fixed length: each is a task and
/// writes its own sums, which are added up in a fixed order.
class PointPasses {
 public:
  explicit PointPasses(const CpuKernels& kernels) : kernels_(kernels) {}

  void survey(const PointsView& points, Survey& survey);
  void weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<float> distances,
             std::span<Evidence> evidence);
  void claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models, std::span<std::uint16_t> labels,
             std::span<Evidence> evidence);

 private:
  void survey_with(CpuKernels::Look look, const PointsView& points, Survey& survey);
  /// `evidence_` of each run, one a model, into one.
  void add_up(std::size_t runs, std::span<Evidence> evidence) const;

  const CpuKernels& kernels_;
  std::vector<Evidence> evidence_;     ///< a run and a model
  std::vector<std::uint8_t> claimed_;  ///< the same: was any point of the strip at hand given to it?
};

}  // namespace swarmfit::kernels::cpu
