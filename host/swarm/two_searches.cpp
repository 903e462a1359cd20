#include "host/swarm/two_searches.hpp"

#include <atomic>
#include <functional>
#include <thread>

namespace swarmfit::swarm {
namespace {

/// `here` in this thread and `beside`, once, in whichever comes to it: one of those that share the evaluator's work while this one is busy,
/// or this one afterwards.
void run_beside(kernels::FitnessEvaluator& workers, const std::function<void()>& here, const std::function<void()>& beside) {
  const auto caller = std::this_thread::get_id();
  bool begun = false;
  std::atomic_flag taken;
  const auto task = [&](std::size_t) {
    if (std::this_thread::get_id() == caller && !begun) {
      begun = true;
      return here();
    }
    if (!taken.test_and_set()) beside();
  };
  workers.share_out(2, std::cref(task));  // a reference fits where a function is kept
  // Where more than one other thread has come, both tasks may have been theirs.
  if (!begun) here();
  if (!taken.test_and_set()) beside();
}

}  // namespace

Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, kernels::FitnessEvaluator* workers,
                        const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                        std::span<const Known> known) {
  again.draw_otherwise();
  FitResult aside;
  Expected<> looked, looked_again;
  const auto look = [&] {
    // Whatever ends the first before its time, be it an exception, ends the other.
    struct Told {
      std::stop_source& stop;
      bool well = false;
      ~Told() {
        if (!well) stop.request_stop();
      }
    } told{stop_again};
    looked = first.look_for_models(on_model, warm_start, result, known);
    told.well = looked && !first.stopped_by_caller();
  };
  const auto look_again = [&] { looked_again = again.run({}, {}, aside, known); };
  if (workers != nullptr) {
    run_beside(*workers, look, look_again);
  } else {
    look();
    again.points_are_set();
    look_again();
  }
  if (!looked) return looked;
  if (!looked_again) return looked_again;
  const std::span<const models::Placed> others = first.stopped_by_caller() ? std::span<const models::Placed>() : again.found();
  return first.conclude(on_model, result, others, workers == nullptr ? kernels::Effort{} : again.effort());
}

}  // namespace swarmfit::swarm
