// One swarm: particles that fly over a landscape until the best place found has stood still (Algorithm 1 of Zhou et al. 2010).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/settings.hpp"
#include "kernels/hyperplane_flight.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// chi = 2 / |2 - c - sqrt(c^2 - 4 c)|, c = c1 + c2: the constriction factor of Eq. (1). 1 where c <= 4.
double constriction(double c1, double c2);

/// Eq. (2): index drawn from a list of fitnesses to be minimised, with shares by improvement over the worst of the list.
/// `u` in [0, 1); all equal: the last, which is the newest.
std::size_t roulette(std::span<const double> fitness, double u);

struct GlobalBest {
  models::Position position;
  double fitness = 0;
};

class Swarm {
 public:
  Swarm(const models::ModelSpace& space, const Settings& settings, const Random& random);
  Swarm(const models::ModelSpace& space, Settings&& settings, const Random& random) = delete;  // it looks into them as long as it lives

  /// From now on particles are placed and moved side by side on the evaluator's threads, where these are awake anyway for so many or a
  /// kind's samples take long. The same places come out.
  void share_work(kernels::FitnessEvaluator& evaluator) noexcept { evaluator_ = &evaluator; }
  /// Starters at minimal samples, the first of them at `seeds`. False if the data yield no sample at all.
  bool start(const Sampler& sampler, std::uint32_t round, std::span<const models::Position> seeds);
  /// Scores every particle; from the second step on it moves first. `scale`: fitness of a model that explains nothing, by which stillness
  /// is judged.
  Expected<> step(Landscape& landscape, const Sampler& sampler, double scale);

  bool converged() const noexcept { return still_steps_ >= settings_.stall; }
  int steps() const noexcept { return steps_; }
  const models::Position& best() const noexcept { return list_.back().position; }
  /// Of the best, against a model that explains nothing.
  double saving() const noexcept { return list_.empty() ? 0.0 : scale_ - list_.back().fitness; }
  double best_fitness() const noexcept { return list_.back().fitness; }
  /// The last n global bests, oldest first.
  std::span<const GlobalBest> global_bests() const noexcept { return list_; }
  /// Where particles were scored last, or will be first, and with what fitness.
  std::span<const models::Position> positions() const noexcept { return positions_; }
  std::span<const double> fitness() const noexcept { return fitness_; }
  std::span<const models::Position> own_bests() const noexcept { return own_best_; }
  std::span<const double> own_fitness() const noexcept { return own_fitness_; }
  /// Of each stretch of the ring, six in all, the particle that knows the best place; the fittest first. Neighbours on the ring know alike.
  kernels::Reused<std::size_t> best_of_stretches() const;

 private:
  void remember();
  /// Once the starters are scored: the fittest of them, in their order, get random velocities of the size of the swarm that they were. The
  /// others are forgotten.
  void set_off();
  void move(const Sampler& sampler);
  /// Is it a particle's turn to start anew from a sample?
  bool is_renewed(std::size_t particle) const noexcept;
  void fly(std::size_t particle);
  /// The same for all of a swarm at once, where kernels know how.
  void fly_together();
  /// The random r1 and r2 of Eq. (1) for a particle's entries d and d + 1, at this step.
  std::array<std::uint32_t, 4> factors(std::size_t particle, std::size_t d) const;
  /// Puts particles at samples of their own: placed[k] is 0, and the k-th stays where it is, where the data yield none.
  void put_at_samples(const Sampler& sampler, std::span<const Sampler::Ask> asks, std::span<std::uint8_t> placed);
  /// Whose threads share the work on so many particles, or null.
  kernels::FitnessEvaluator* workers() const noexcept;
  /// body(first, last) for runs of particles, side by side. What it does with one particle must not matter to another.
  template <class Body>
  void for_particles(const Body& body) const;
  const models::Position& attractor(std::size_t particle) const;

  const models::ModelSpace& space_;
  const Settings& settings_;
  const Random& random_;
  double chi_;
  kernels::FitnessEvaluator* evaluator_ = nullptr;  // whose threads may share the work
  std::uint32_t round_ = 0;
  int steps_ = 0;
  int still_steps_ = 0;
  double scale_ = 0;
  double still_since_ = 0;  // fitness of the global best when it last moved
  kernels::Reused<models::Position> positions_, velocities_, own_best_;
  kernels::Reused<double> fitness_, own_fitness_;
  std::optional<kernels::HyperplaneFlight> together_;
  kernels::Reused<GlobalBest> list_;
};

}  // namespace swarmfit::swarm
