// Many small problems scored together, each a cloud and a swarm of its own: what fills a device that one of them would leave idle.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "kernels/evaluators.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::kernels {

/// One problem's swarm, as FitnessEvaluator::evaluate takes it; the spans belong to the caller.
struct BatchItem {
  std::size_t problem = 0;
  SwarmView swarm;
  Loss loss = Loss::truncated_l1;
  std::span<const float> cutoffs;  ///< may be made use of, or not
  std::span<float> costs;
};

/// As many FitnessEvaluators as there are problems, but for evaluate(), which asks all that have something to ask at once. A problem's
/// costs are those that it has alone, to the byte, whatever the others ask.
/// Not thread-safe, but for this: while nobody evaluates, different threads may set points and caps of different problems.
class BatchEvaluator {
 public:
  virtual ~BatchEvaluator() = default;
  BatchEvaluator() = default;
  BatchEvaluator(const BatchEvaluator&) = delete;
  BatchEvaluator& operator=(const BatchEvaluator&) = delete;

  virtual const Identity& identity() const noexcept = 0;
  virtual std::size_t problems() const noexcept = 0;
  /// Of one problem.
  virtual Support supports(const Workload& workload) const = 0;

  /// Fail as FitnessEvaluator's do, and with `invalid` where there is no such problem.
  virtual Result<> set_points(std::size_t problem, const PointsView& points) = 0;
  virtual Result<> set_caps(std::size_t problem, std::span<const float> caps) = 0;

  /// Costs of every item, in one submission where the device's limits allow. An item that is out of bounds fails the whole with `invalid`,
  /// and nothing is evaluated; so does a problem that is asked twice.
  virtual Result<> evaluate(std::span<const BatchItem> items) = 0;

  /// Of one problem, since its set_points.
  virtual Effort effort(std::size_t problem) const noexcept = 0;
  /// How often a device was set to work so far.
  virtual std::uint64_t submissions() const noexcept = 0;
};

/// `name`: as make_evaluator takes it; options.own must be null. Fails with `invalid` or `unavailable`. On a processor each problem has an
/// evaluator of one thread, and options.threads of them work side by side.
Result<std::unique_ptr<BatchEvaluator>> make_batch_evaluator(std::string_view name, const EvaluatorOptions& options, std::size_t problems);

/// One a device, defined in the back end's folder; `device` as make_vulkan_evaluator takes it.
Result<std::unique_ptr<BatchEvaluator>> make_vulkan_batch(const EvaluatorOptions& options, std::string_view device, std::size_t problems);

/// `invalid` where a problem's number is too high, or asked twice.
Result<> check_problem(std::size_t problem, std::size_t problems);
Result<> check_batch(std::span<const BatchItem> items, std::size_t problems);

}  // namespace swarmfit::kernels
