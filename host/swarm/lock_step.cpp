#include "host/swarm/lock_step.hpp"

#include <algorithm>
#include <atomic>
#include <latch>
#include <optional>
#include <system_error>
#include <thread>

#include "host/swarm/fitter_parts.hpp"

namespace swarmfit::swarm {
namespace {

using kernels::Result;

/// What one fit takes for its evaluator.
class StepEvaluator final : public kernels::FitnessEvaluator {
 public:
  StepEvaluator(kernels::BatchEvaluator& batch, LockStep& step, std::size_t fit) : batch_(batch), step_(step), fit_(fit) {}

  const kernels::Identity& identity() const noexcept override { return batch_.identity(); }
  kernels::Support supports(const kernels::Workload& workload) const override { return batch_.supports(workload); }
  // While this fit runs nobody evaluates.
  Result<> set_points(const kernels::PointsView& points) override { return batch_.set_points(fit_, points); }
  Result<> set_caps(std::span<const float> caps) override { return batch_.set_caps(fit_, caps); }
  Result<> evaluate(const kernels::SwarmView& swarm, kernels::Loss loss, std::span<const float> cutoffs, std::span<float> costs) override {
    return step_.evaluate({fit_, swarm, loss, cutoffs, costs});
  }
  kernels::Effort effort() const noexcept override { return batch_.effort(fit_); }

  // A fit measures distances and labels by the passes over its own points.
  Result<> distances(const kernels::ModelView&, std::span<float>) override { return refuse(); }
  Result<> assign(std::span<const kernels::ModelView>, std::span<const float>, std::span<std::uint16_t>) override { return refuse(); }

 private:
  static Result<> refuse() { return kernels::fail(kernels::Failure::Kind::unavailable, "a batch only evaluates swarms"); }

  kernels::BatchEvaluator& batch_;
  LockStep& step_;
  std::size_t fit_;
};

}  // namespace

LockStep::LockStep(kernels::BatchEvaluator& batch, std::size_t fits, std::size_t at_once)
    : batch_(batch), at_once_(at_once), seats_(std::make_unique<Seat[]>(fits)) {
  ready_.reserve(fits);
  waiting_.reserve(fits);
  for (std::size_t fit = 0; fit < fits; ++fit) ready_.push_back(fit);
  wake_some();
}

void LockStep::wake_some() {
  for (; running_ < at_once_ && !ready_.empty(); ++running_) {
    const std::size_t next = ready_.back();
    ready_.pop_back();
    seats_[next].turn.release();
  }
}

void LockStep::leave() {
  const std::lock_guard lock(mutex_);
  pass_on();
}

Result<> LockStep::evaluate(const kernels::BatchItem& item) {
  Seat& seat = seats_[item.problem];
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(item);
    pass_on();
  }
  seat.turn.acquire();
  return seat.done;
}

/// Who calls runs no more.
void LockStep::pass_on() {
  --running_;
  wake_some();
  if (running_ == 0 && !waiting_.empty()) score();
}

void LockStep::score() {
  const Result<> done = batch_.evaluate(waiting_);
  swarms_ += waiting_.size();
  for (const kernels::BatchItem& item : waiting_) {
    seats_[item.problem].done = done;
    ready_.push_back(item.problem);
  }
  waiting_.clear();
  wake_some();
}

StepReport fit_in_step(std::span<const PointsView> clouds, const FitOptions& options, int threads, kernels::BatchEvaluator& batch,
                       const std::string& reason, std::span<Expected<FitResult>> results) {
  const std::uint64_t before = batch.submissions();
  const std::size_t at_once = threads > 0 ? static_cast<std::size_t>(threads) : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t wanted = std::min(clouds.size(), batch.problems());
  std::atomic<std::size_t> next = 0;
  std::optional<LockStep> step;
  std::latch begun(1);
  // The threads that can be had are told to the step before any of them enters it.
  const auto work = [&](std::size_t fit) {
    begun.wait();
    step->enter(fit);
    Fitter fitter = FitterParts::assemble(options, std::make_unique<StepEvaluator>(batch, *step, fit), reason);
    for (std::size_t k = next++; k < clouds.size(); k = next++) results[k] = fitter.fit(clouds[k]);
    step->leave();
  };
  std::vector<std::thread> others;
  others.reserve(wanted);
  try {
    while (others.size() + 1 < wanted) others.emplace_back(work, others.size() + 1);
  } catch (const std::system_error&) {
    // As many as there are; the caller's is one of them.
  }
  step.emplace(batch, others.size() + 1, at_once);
  begun.count_down();
  work(0);
  for (std::thread& thread : others) thread.join();
  return {batch.submissions() - before, step->swarms()};
}

}  // namespace swarmfit::swarm
