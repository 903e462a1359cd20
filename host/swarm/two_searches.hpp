// Two searches of the same points that end as one: what one of them has missed the other may have found.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/multi_model.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::swarm {

/// Runs `first`, and `again` by other random numbers, and ends the first with what both have found. Where `workers` is not null each has an
/// evaluator of its own, and they go side by side on the threads of `workers`, the first on the caller's; else they have the same one, and go
/// one after the other. The result is the same. Callbacks and a warm start are the first's alone; where the caller has enough, the second
/// is told to stop, by `stop_again` that its limits know, and does not count.
Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, kernels::FitnessEvaluator* workers,
                        const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                        std::span<const Known> known);

}  // namespace swarmfit::swarm
