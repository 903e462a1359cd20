// What the swarms of a search do, step by step, for who wants to watch.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/model.hpp>

namespace swarmfit {

/// One step of one swarm. Fitness is to be minimised; that of a position no better than the particle's own best may be told too low, but
/// never below that best. Step 0 has all samples that the swarm begins with; the fittest of them, in their order, are the particles of the
/// steps after it.
struct SwarmStep {
  ModelType type = ModelType::plane;
  std::size_t swarm = 0;      ///< 0, 1 ...: one swarm flies after another
  std::size_t step = 0;       ///< of this swarm, from 0
  Eigen::MatrixXd positions;  ///< a column a particle, at step 0 a sample: parameters as listed at ModelType, in the data's frame and unit
  std::vector<double> fitness;   ///< one a column [data unit]
  Eigen::VectorXd best;          ///< the global best of this swarm so far
  double best_fitness = 0;       ///< [data unit]
  double nothing_explained = 0;  ///< fitness of a model that explains no point [data unit]
};

/// Called after each step, in the fit's own thread; what it watches is the same as without it, and slower by what it does. What it throws
/// comes back to the fit's caller, and the fit ends.
using SwarmObserver = std::function<void(const SwarmStep&)>;

}  // namespace swarmfit
