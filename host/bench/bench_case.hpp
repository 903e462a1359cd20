// What a row of the benchmark evaluates: a cloud, caps, and the positions of a real swarm that flies over it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/model.hpp>
#include <swarmfit/points.hpp>

#include "kernels/fitness_evaluator.hpp"

namespace swarmfit::bench_internal {

/// One step of the swarm: its positions, and the personal bests that serve as cutoffs.
struct Step {
  std::vector<double> parameters;
  std::vector<float> cutoffs;
  std::vector<float> reference;  ///< costs by the reference back end; empty where the step is not checked
};

struct Case {
  kernels::ModelKind kind = kernels::ModelKind::plane;
  PointsView points;
  std::vector<float> caps;
  double nothing_explained = 0;  ///< sum of the caps
  std::size_t particles = 0;
  std::vector<Step> steps;
};

/// Lets a swarm of `particles` fly for some steps and keeps what it asked for, with the reference's answers to the first and the last.
Expected<Case> make_case(ModelType type, const PointsView& points, std::size_t particles, std::uint64_t seed, int threads);

}  // namespace swarmfit::bench_internal
