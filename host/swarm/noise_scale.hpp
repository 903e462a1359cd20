// The threshold from the data themselves.
#pragma once

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::swarm {

struct Watch;

/// Standard deviation of the Gaussian part of |distances| within `reach`, against a uniform background; by expectation-maximisation
/// from `guess`. Distances beyond reach and NaN are left out. 0 where there is none.
double gaussian_part(std::span<const float> distances, double guess, double reach);

struct NoiseScale {
  double threshold = 0;       ///< tau [data unit]
  std::vector<Known> models;  ///< the prominent models that told it, refined under it; nobody need search for them again
};

/// tau = 2.5 sigma of a point whose `spread` is 1 (noise_model.hpp; empty: of all), sigma the noise of the most prominent models: a swarm
/// finds one under a generous threshold, the spread of its inliers gives the next threshold, until that stays. `points` stand for a whole
/// cloud of `finite_points`; `part` of them as MultiModel takes it; `watch` may look on. Fails with bad_input where the data show no scale.
Expected<NoiseScale> estimate_threshold(kernels::FitnessEvaluator& evaluator, const models::WorkingPoints& points, const Part& part,
                                        std::size_t finite_points, const FitOptions& options, Watch* watch = nullptr,
                                        std::span<const float> spread = {});

}  // namespace swarmfit::swarm
