// One swarm's flight, step by step.
#pragma once

#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"

namespace swarmfit::figures {

/// Positions are in the data's frame and unit.
struct Step {
  std::vector<models::Position> positions;  ///< one a particle, after as many moves as steps came before
  std::vector<double> fitness;              ///< of these positions, exact
  models::Position best;                    ///< the global best so far
  double best_fitness = 0;
};

struct Flight {
  std::vector<Step> steps;
  std::size_t converged = 0;     ///< the step after which the fit would have stopped; 0: within these steps it would not
  double nothing_explained = 0;  ///< fitness of a model that explains no point
};

/// The first swarm of a fit with these options, which must give a threshold. It flies on past convergence, for `moves` moves.
Expected<Flight> fly(const PointsView& points, const FitOptions& options, int moves);

}  // namespace swarmfit::figures
