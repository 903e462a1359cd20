#include "host/figures/flight.hpp"

#include "host/models/working_points.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"
#include "host/swarm/swarm.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::figures {

Expected<Flight> fly(const PointsView& points, const FitOptions& options, int moves) {
  kernels::EvaluatorOptions wanted;
  wanted.threads = options.threads;
  wanted.pruning = false;  // or fitness that is no particle's best would only be known to be no better than that
  auto made = kernels::make_evaluator(options.backend, wanted);
  if (!made) return tl::unexpected(swarm::to_error(made.error()));
  kernels::FitnessEvaluator& evaluator = *made->evaluator;

  const auto space = models::make_space(options.model, options.prior);
  models::WorkingPoints working(points);
  const swarm::Random random(options.seed);
  const swarm::Settings settings = swarm::resolve(options, working.finite_count(), *options.threshold);
  const swarm::Part part = swarm::look_closely(working, *space, random, swarm::kSampledFrom);
  const std::vector<float> caps(working.size(), static_cast<float>(settings.threshold));
  if (auto done = evaluator.set_points(working.view()); !done) return tl::unexpected(swarm::to_error(done.error()));
  if (auto done = evaluator.set_caps(caps); !done) return tl::unexpected(swarm::to_error(done.error()));

  Flight flight;
  flight.nothing_explained = settings.threshold * static_cast<double>(working.finite_count());
  swarm::Landscape landscape(evaluator, *space, working.frame(), settings);
  const swarm::Sampler sampler(working, part.points.index(), part.neighbours, *space, random);
  swarm::Swarm swarm(*space, settings, random);
  if (!swarm.start(sampler, 0, {})) return fail(Error::Kind::bad_input, "the points determine no model");
  for (int k = 0; k <= moves; ++k) {
    Step step;
    if (auto done = swarm.step(landscape, sampler, flight.nothing_explained); !done) return tl::unexpected(done.error());
    for (const models::Position& theta : swarm.positions()) step.positions.push_back(space->to_data(theta, working.frame()));
    step.fitness.assign(swarm.fitness().begin(), swarm.fitness().end());
    step.best = space->to_data(swarm.best(), working.frame());
    step.best_fitness = swarm.best_fitness();
    flight.steps.push_back(std::move(step));
    if (flight.converged == 0 && swarm.converged()) flight.converged = flight.steps.size() - 1;
  }
  return flight;
}

}  // namespace swarmfit::figures
