// Refinement of models on their own inliers, one by one and all together.
#pragma once

#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::swarm {

/// What refinement works on.
struct Ground {
  kernels::FitnessEvaluator& evaluator;
  const models::ModelSpace& space;
  const models::WorkingPoints& points;
  std::span<const float> tau;            ///< one a point of the evaluator [data unit]
  std::span<const std::uint32_t> index;  ///< input index of each point of the evaluator; empty: it holds the whole cloud
};

/// Least absolute deviations, by reweighting, on the points within tau that are not better explained already (distance below their cap),
/// repeated while the truncated loss falls, `rounds` times at most. `loss` is that of theta on entry and on return; it never rises.
Expected<> refine_one(const Ground& ground, Landscape& landscape, std::span<const float> caps, models::Position& theta, double& loss,
                      int rounds = 8);

/// Energy of all models together: sum over points of min(tau_i, distance to the nearest model) [data unit].
/// Refits every model to the points within tau of it while the energy falls; it never rises. Returns the energy. The evaluator must hold
/// the whole cloud.
Expected<double> refine_jointly(const Ground& ground, std::vector<models::Position>& models, int rounds = 8);

/// For each model, the points within tau of it and of no other: what would be lost without it.
Expected<std::vector<std::size_t>> unique_support(const Ground& ground, const std::vector<models::Position>& models);

}  // namespace swarmfit::swarm
