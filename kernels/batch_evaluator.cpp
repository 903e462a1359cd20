#include "kernels/batch_evaluator.hpp"

#include <new>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace swarmfit::kernels {
namespace {

/// For back ends without a batch of their own: an evaluator a problem.
class EvaluatorEach final : public BatchEvaluator {
 public:
  EvaluatorEach(std::vector<std::unique_ptr<FitnessEvaluator>> evaluators, int threads)
      : evaluators_(std::move(evaluators)), arena_(threads > 0 ? threads : tbb::task_arena::automatic) {}

  const Identity& identity() const noexcept override { return evaluators_.front()->identity(); }
  std::size_t problems() const noexcept override { return evaluators_.size(); }
  Support supports(const Workload& workload) const override { return evaluators_.front()->supports(workload); }

  Result<> set_points(std::size_t problem, const PointsView& points) override {
    if (auto ok = check_problem(problem, problems()); !ok) return ok;
    return evaluators_[problem]->set_points(points);
  }
  Result<> set_caps(std::size_t problem, std::span<const float> caps) override {
    if (auto ok = check_problem(problem, problems()); !ok) return ok;
    return evaluators_[problem]->set_caps(caps);
  }

  Result<> evaluate(std::span<const BatchItem> items) override try {
    if (auto ok = check_batch(items, problems()); !ok) return ok;
    if (items.empty()) return {};
    std::vector<Result<>> done(items.size());
    const auto one = [&](std::size_t i) {
      const BatchItem& item = items[i];
      done[i] = evaluators_[item.problem]->evaluate(item.swarm, item.loss, item.cutoffs, item.costs);
    };
    arena_.execute([&] { tbb::parallel_for(std::size_t{0}, items.size(), one); });
    ++submissions_;
    for (Result<>& each : done) {
      if (!each) return each;
    }
    return {};
  } catch (const std::bad_alloc&) {
    return fail(Failure::Kind::out_of_memory, fmt::format("no memory for a batch of {} swarms", items.size()));
  }

  Effort effort(std::size_t problem) const noexcept override { return problem < problems() ? evaluators_[problem]->effort() : Effort{}; }
  std::uint64_t submissions() const noexcept override { return submissions_; }

 private:
  std::vector<std::unique_ptr<FitnessEvaluator>> evaluators_;
  tbb::task_arena arena_;
  std::uint64_t submissions_ = 0;
};

}  // namespace

Result<> check_problem(std::size_t problem, std::size_t problems) {
  if (problem < problems) return {};
  return fail(Failure::Kind::invalid, fmt::format("problem is {}, must be < {}", problem, problems));
}

Result<> check_batch(std::span<const BatchItem> items, std::size_t problems) {
  std::vector<bool> asked(problems);
  for (const BatchItem& item : items) {
    if (auto ok = check_problem(item.problem, problems); !ok) return ok;
    if (asked[item.problem]) return fail(Failure::Kind::invalid, fmt::format("problem {} is asked twice, must be once", item.problem));
    asked[item.problem] = true;
  }
  return {};
}

Result<std::unique_ptr<BatchEvaluator>> make_batch_evaluator(std::string_view name, const EvaluatorOptions& options, std::size_t problems) {
  if (problems < 1) return fail(Failure::Kind::invalid, fmt::format("problems is {}, must be >= 1", problems));
  if (options.own) return fail(Failure::Kind::invalid, fmt::format("own is {}, must be null in a batch", options.own->name));
  EvaluatorOptions each = options;
  if (options.threads >= 0) each.threads = 1;
  auto first = make_evaluator(name, each);
  if (!first) return tl::unexpected(first.error());
  const Identity& who = first->evaluator->identity();
  if (who.backend == "vulkan") return make_vulkan_batch(options, who.device, problems);
  std::vector<std::unique_ptr<FitnessEvaluator>> evaluators;
  evaluators.push_back(std::move(first->evaluator));
  while (evaluators.size() < problems) {
    auto another = make_evaluator(name, each);
    if (!another) return tl::unexpected(another.error());
    evaluators.push_back(std::move(another->evaluator));
  }
  return std::make_unique<EvaluatorEach>(std::move(evaluators), options.threads);
}

#ifndef SWARMFIT_HAVE_VULKAN
Result<std::unique_ptr<BatchEvaluator>> make_vulkan_batch(const EvaluatorOptions&, std::string_view, std::size_t) {
  return fail(Failure::Kind::unavailable, "backend is 'vulkan', but this build has no Vulkan (SWARMFIT_VULKAN=OFF)");
}
#endif

}  // namespace swarmfit::kernels
