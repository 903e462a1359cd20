#include "host/swarm/lock_step.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <latch>
#include <new>
#include <optional>
#include <thread>
#include <utility>

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

/// Without these words where there is no memory for them.
tl::unexpected<kernels::Failure> failed(kernels::Failure::Kind kind, const char* words) noexcept {
  kernels::Failure failure{kind, "no memory"};  // short enough to need none
  try {
    failure.message = words;
  } catch (const std::bad_alloc&) {
  }
  return tl::unexpected<kernels::Failure>(std::move(failure));
}

/// What is thrown becomes a failure.
Result<> evaluate_all(kernels::BatchEvaluator& batch, std::span<const kernels::BatchItem> items) noexcept {
  try {
    return batch.evaluate(items);
  } catch (const std::bad_alloc&) {
    return failed(kernels::Failure::Kind::out_of_memory, "no memory");
  } catch (const std::exception& e) {
    return failed(kernels::Failure::Kind::device, e.what());
  }
}

/// None where there is no memory for it.
std::optional<Fitter> assemble(const FitOptions& options, kernels::BatchEvaluator& batch, LockStep& step, std::size_t fit,
                               const std::string& reason) noexcept {
  try {
    return FitterParts::assemble(options, std::make_unique<StepEvaluator>(batch, step, fit), reason);
  } catch (const std::bad_alloc&) {
    return std::nullopt;
  }
}

}  // namespace

LockStep::LockStep(kernels::BatchEvaluator& batch, std::size_t fits, std::size_t at_once)
    : batch_(batch), at_once_(at_once), seats_(std::make_unique<Seat[]>(fits)) {
  ready_.reserve(fits);
  waiting_.reserve(fits);
}

void LockStep::begin(std::size_t fits) noexcept {
  const std::lock_guard lock(mutex_);
  for (std::size_t fit = 0; fit < fits; ++fit) ready_.push_back(fit);
  wake_some();
}

void LockStep::wake_some() noexcept {
  for (; running_ < at_once_ && !ready_.empty(); ++running_) {
    const std::size_t next = ready_.back();
    ready_.pop_back();
    seats_[next].turn.release();
  }
}

void LockStep::leave() noexcept {
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
void LockStep::pass_on() noexcept {
  --running_;
  wake_some();
  if (running_ == 0 && !waiting_.empty()) score();
}

void LockStep::score() noexcept {
  // Nothing may be thrown here: the others wait for their turn.
  const Result<> done = evaluate_all(batch_, waiting_);
  swarms_ += waiting_.size();
  for (const kernels::BatchItem& item : waiting_) {
    seats_[item.problem].done = done ? Result<>() : failed(done.error().kind, done.error().message.c_str());
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
  LockStep step(batch, wanted, at_once);
  std::latch begun(1);
  const auto work = [&](std::size_t fit) noexcept {
    begun.wait();
    step.enter(fit);
    if (auto fitter = assemble(options, batch, step, fit, reason)) {
      for (std::size_t k = next++; k < clouds.size(); k = next++) results[k] = fitter->fit(clouds[k]);
    }
    step.leave();
  };
  // The threads that can be had are told to the step before any of them enters it.
  std::vector<std::jthread> others;
  others.reserve(wanted);
  try {
    while (others.size() + 1 < wanted) others.emplace_back(work, others.size() + 1);
  } catch (const std::exception&) {
    // As many as there are; the caller's is one of them.
  }
  step.begin(others.size() + 1);
  begun.count_down();
  work(0);
  others.clear();  // when they have ended
  for (std::size_t k = next; k < clouds.size(); ++k) results[k] = fail(Error::Kind::out_of_memory, "no memory");
  return {batch.submissions() - before, step.swarms()};
}

}  // namespace swarmfit::swarm
