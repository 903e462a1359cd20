// Many small fits on one device: each goes its own way on the host, and whenever all of them wait for a swarm's costs, one submission
// scores all these swarms.
//
// The loop of a fit is deep (threshold, models, contests, polishing, labels), and turning it inside out so that it could stop at every
// swarm would cost its readability. So each fit has a thread that stops in the evaluator's place, and the last one to ask submits for
// all. As a problem's costs do not depend on what else is submitted, a fit's answer is that of the fit alone, whichever others are under
// way.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <semaphore>
#include <span>
#include <vector>

#include <swarmfit/fit.hpp>

#include "kernels/batch_evaluator.hpp"

namespace swarmfit::swarm {

/// Keeps so many fits in step, each on a thread of its own, with the number of its problem.
class LockStep {
 public:
  /// Room for so many fits. `at_once`: how many of the threads may run side by side, >= 1. `batch` must outlive this, and has no fewer
  /// problems than `fits`.
  LockStep(kernels::BatchEvaluator& batch, std::size_t fits, std::size_t at_once);

  /// Once: the first so many fits are announced, and each will enter and leave.
  void begin(std::size_t fits) noexcept;
  /// The first thing a fit's thread does: waits for its turn.
  void enter(std::size_t fit) { seats_[fit].turn.acquire(); }
  /// The last thing, for every fit that was announced.
  void leave() noexcept;
  /// Waits until all fits have asked or left; `item.problem` is the fit's. A device's failure is everybody's.
  kernels::Result<> evaluate(const kernels::BatchItem& item);

  /// Swarms scored so far.
  std::uint64_t swarms() const noexcept { return swarms_; }

 private:
  struct Seat {
    std::binary_semaphore turn{0};
    kernels::Result<> done;
  };

  void pass_on() noexcept;
  void score() noexcept;
  void wake_some() noexcept;

  kernels::BatchEvaluator& batch_;
  std::size_t at_once_;
  std::mutex mutex_;
  std::unique_ptr<Seat[]> seats_;
  std::size_t running_ = 0;
  std::vector<std::size_t> ready_;           // whose turn may come
  std::vector<kernels::BatchItem> waiting_;  // for their costs
  std::uint64_t swarms_ = 0;
};

struct StepReport {
  std::uint64_t submissions = 0;
  std::uint64_t swarms = 0;
};

/// results[k] = fit(clouds[k], options), but for its times and, on a Vulkan device, points_touched: everything is computed there. As many
/// fits as the batch has problems are under way. `batch` is of the back end that the options ask for, `reason` says why; the options are
/// valid and ask for neither an own model nor a time budget. So many threads run side by side on the host, 0 as many as the machine has.
/// Fewer threads where no more can be had. A cloud that no fit could be made for has out_of_memory for its result; what runs out before
/// any has begun is thrown.
StepReport fit_in_step(std::span<const PointsView> clouds, const FitOptions& options, int threads, kernels::BatchEvaluator& batch,
                       const std::string& reason, std::span<Expected<FitResult>> results);

}  // namespace swarmfit::swarm
