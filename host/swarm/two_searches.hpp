// Two searches of the same points that end as one: what one of them has missed the other may have found.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/multi_model.hpp"

namespace swarmfit::swarm {

/// Runs `first`, and `again` by other random numbers, and ends the first with what both have found. With `workers`, on whose threads they
/// run side by side, each has a back end of its own; without, they run one after the other on the one they share. The result is the same.
/// The first runs in the caller's thread; callbacks and a warm start are its alone. Where the caller has enough, the second is told to
/// stop, by `stop_again` that its limits know, and does not count.
Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, kernels::FitnessEvaluator* workers,
                        const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                        std::span<const Known> known);

}  // namespace swarmfit::swarm
