#include "host/swarm/two_searches.hpp"

#include <exception>
#include <functional>
#include <system_error>
#include <thread>

namespace swarmfit::swarm {
namespace {

/// `here` in this thread and, meanwhile, `beside` in another; after it where no thread can be had. What either throws is thrown here; where
/// that is `here`, `beside` is asked to stop.
void run_beside(const std::function<void()>& here, const std::function<void()>& beside, std::stop_source& stop_beside) {
  std::exception_ptr thrown;
  std::jthread other;
  try {
    other = std::jthread([&] {
      try {
        beside();
      } catch (...) {
        thrown = std::current_exception();
      }
    });
  } catch (const std::system_error&) {
    here();
    return beside();
  }
  try {
    here();
  } catch (...) {
    stop_beside.request_stop();
    throw;  // the other thread is waited for on the way
  }
  other.join();
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace

Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, Together how, const ModelCallback& on_model,
                        const std::vector<Model>& warm_start, FitResult& result, std::span<const Known> known) {
  again.draw_otherwise();
  FitResult aside;
  Expected<> looked, looked_again;
  const auto look = [&] {
    looked = first.look_for_models(on_model, warm_start, result, known);
    if (!looked || first.stopped_by_caller()) stop_again.request_stop();
  };
  const auto look_again = [&] { looked_again = again.run({}, {}, aside, known); };
  if (how == Together::at_once) {
    run_beside(look, look_again, stop_again);
  } else {
    look();
    if (how == Together::on_one_evaluator) again.points_are_set();
    look_again();
  }
  if (!looked) return looked;
  if (!looked_again) return looked_again;
  const std::span<const models::Placed> others = first.stopped_by_caller() ? std::span<const models::Placed>() : again.found();
  return first.conclude(on_model, result, others, how == Together::on_one_evaluator ? kernels::Effort{} : again.effort());
}

}  // namespace swarmfit::swarm
