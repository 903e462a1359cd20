// Two searches of the same points that end as one: what one of them has missed the other may have found.
#pragma once

#include <span>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/multi_model.hpp"

namespace swarmfit::swarm {

/// How two searches share what they work on.
enum class Together {
  on_one_evaluator,  ///< one after the other
  in_turn,           ///< on one each, one after the other
  at_once,           ///< on one each, the second in a thread of its own, if there is one to be had
};

/// Runs `first`, and `again` by other random numbers, and ends the first with what both have found. The result does not depend on `how`.
/// The first runs in the caller's thread; callbacks and a warm start are its alone. Where the caller has enough, the second is told to
/// stop, by `stop_again` that its limits know, and does not count.
Expected<> search_twice(MultiModel& first, MultiModel& again, std::stop_source& stop_again, Together how, const ModelCallback& on_model,
                        const std::vector<Model>& warm_start, FitResult& result, std::span<const Known> known);

}  // namespace swarmfit::swarm
