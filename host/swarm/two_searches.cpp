#include "host/swarm/two_searches.hpp"

namespace swarmfit::swarm {

Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, kernels::FitnessEvaluator* workers,
                        const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                        std::span<const Known> known) {
  again.draw_otherwise();
  FitResult aside;
  Expected<> looked, looked_again;
  const auto search = [&](std::size_t which) {
    if (which == 0) {
      looked = first.look_for_models(on_model, warm_start, result, known);
      if (!looked || first.stopped_by_caller()) stop_again.request_stop();
    } else {
      looked_again = again.run({}, {}, aside, known);
    }
  };
  if (workers != nullptr) {
    workers->share_out(2, search);
  } else {
    search(0);
    again.points_are_set();
    search(1);
  }
  if (!looked) return looked;
  if (!looked_again) return looked_again;
  const std::span<const models::Placed> others = first.stopped_by_caller() ? std::span<const models::Placed>() : again.found();
  return first.conclude(result, others, workers != nullptr ? again.effort() : kernels::Effort{});
}

}  // namespace swarmfit::swarm
