#include "host/swarm/swarm.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "kernels/reused.hpp"

namespace swarmfit::swarm {

double constriction(double c1, double c2) {
  const double c = c1 + c2;
  return c > 4 ? 2.0 / std::abs(2.0 - c - std::sqrt(c * c - 4.0 * c)) : 1.0;
}

std::size_t roulette(std::span<const double> fitness, double u) {
  const double worst = *std::max_element(fitness.begin(), fitness.end());
  double total = 0;
  for (const double f : fitness) total += worst - f;
  if (!(total > 0)) return fitness.size() - 1;
  double at = u * total;
  for (std::size_t k = 0; k < fitness.size(); ++k) {
    at -= worst - fitness[k];
    if (at < 0) return k;
  }
  return fitness.size() - 1;
}

Swarm::Swarm(const models::ModelSpace& space, const Settings& settings, const Random& random)
    : space_(space), settings_(settings), random_(random), chi_(constriction(settings.cognitive, settings.social)) {
  const auto m = static_cast<std::size_t>(settings.particles);
  velocities_.resize(m);
  if (space.free_normal() > 0 && settings.renewal_share == 0) together_.emplace(static_cast<std::size_t>(space.free_normal()), m);
}

template <class Body>
void Swarm::for_particles(const Body& body) const {
  const std::size_t count = positions_.size(), samples = 2 * space_.samples_at_once();
  kernels::FitnessEvaluator* const workers = this->workers();
  const std::size_t at_once = workers == nullptr ? count : space_.costly_samples() ? std::max<std::size_t>(8, samples) : 32;
  const auto some = [&](std::size_t k) { body(k * at_once, std::min(count, (k + 1) * at_once)); };
  if (workers == nullptr) return some(0);
  workers->share_out((count + at_once - 1) / at_once, std::cref(some));
}

bool Swarm::start(const Sampler& sampler, std::uint32_t round, std::span<const models::Position> seeds) {
  round_ = round;
  steps_ = 0;
  still_steps_ = 0;
  list_.clear();
  const auto m = static_cast<std::size_t>(std::max(settings_.starters, settings_.particles));
  positions_.resize(m);
  fitness_.resize(m);
  own_best_.assign(m, {});
  own_fitness_.assign(m, std::numeric_limits<double>::infinity());
  const auto local = static_cast<std::size_t>(settings_.local_share * static_cast<double>(m));
  kernels::Reused<std::uint8_t> placed(m, 1);
  const std::size_t seeded = std::min(seeds.size(), m);
  std::copy_n(seeds.begin(), seeded, positions_.begin());
  for_particles([&](std::size_t first, std::size_t last) {
    kernels::Reused<Sampler::Ask> asks;
    for (std::size_t j = std::max(first, seeded); j < last; ++j) asks.push_back({static_cast<std::uint32_t>(j), j < local});
    put_at_samples(sampler, asks, std::span(placed).subspan(last - asks.size(), asks.size()));
  });
  // Data that yield no sample at first hardly yield one later.
  if (placed[0] == 0) return false;
  for (std::size_t j = 1; j < m; ++j) {
    if (placed[j] == 0) positions_[j] = positions_[j - 1];
  }
  return true;
}

Expected<> Swarm::step(Landscape& landscape, const Sampler& sampler, double scale) {
  scale_ = scale;
  if (steps_ == 1) set_off();
  if (steps_ > 0) move(sampler);
  if (auto done = landscape.fitness(positions_, own_fitness_, fitness_); !done) return done;
  ++steps_;
  remember();
  return {};
}

void Swarm::set_off() {
  const std::size_t starters = positions_.size(), m = velocities_.size();
  kernels::Reused<std::size_t> order(starters);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (starters > m) {
    const auto last = order.begin() + static_cast<std::ptrdiff_t>(m);
    std::nth_element(order.begin(), last, order.end(),
                     [&](std::size_t a, std::size_t b) { return std::pair(fitness_[a], a) < std::pair(fitness_[b], b); });
    order.resize(m);
    std::sort(order.begin(), order.end());
  }
  for (std::size_t k = 0; k < m; ++k) {
    // Part of the way to another starter.
    const auto words = random_.words(Draw::move, round_, 0, static_cast<std::uint32_t>(order[k]));
    velocities_[k].resize(space_.parameter_count());
    space_.difference(positions_[order[k]], positions_[Random::below(words[0], starters)], velocities_[k]);
    velocities_[k] *= 0.5 * Random::unit(words[1]);
  }
  const auto keep = [&](auto& of_each) {
    for (std::size_t k = 0; k < m; ++k) of_each[k] = of_each[order[k]];
    of_each.resize(m);
  };
  keep(positions_);
  keep(own_best_);
  keep(fitness_);
  keep(own_fitness_);
}

kernels::Reused<std::size_t> Swarm::best_of_stretches() const {
  constexpr std::size_t kStretches = 6;
  const std::size_t particles = own_fitness_.size();
  kernels::Reused<std::size_t> bests;
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t first = k * particles / kStretches, last = (k + 1) * particles / kStretches;
    if (first == last) continue;
    const auto stretch = std::span(own_fitness_).subspan(first, last - first);
    bests.push_back(first + static_cast<std::size_t>(std::min_element(stretch.begin(), stretch.end()) - stretch.begin()));
  }
  std::sort(bests.begin(), bests.end(),
            [&](std::size_t a, std::size_t b) { return std::pair(own_fitness_[a], a) < std::pair(own_fitness_[b], b); });
  return bests;
}

void Swarm::remember() {
  std::size_t best = positions_.size();
  for (std::size_t j = 0; j < positions_.size(); ++j) {
    // Infinite as it may be at first, a particle has a best for others to look at.
    if (fitness_[j] < own_fitness_[j] || own_best_[j].size() == 0) {
      own_fitness_[j] = fitness_[j];
      own_best_[j] = positions_[j];
    }
    if (list_.empty() || fitness_[j] < list_.back().fitness) {
      if (best == positions_.size() || fitness_[j] < fitness_[best]) best = j;
    }
  }
  ++still_steps_;
  if (best == positions_.size()) {
    if (list_.empty()) list_.push_back({positions_[0], fitness_[0]});  // every fitness is infinite
    return;
  }
  const bool first = list_.empty();
  list_.push_back({positions_[best], fitness_[best]});
  if (list_.size() > static_cast<std::size_t>(settings_.roulette_length)) list_.erase(list_.begin());
  const double saving = scale_ - fitness_[best];
  if (first || still_since_ - fitness_[best] > settings_.still * std::max(saving, 0.0)) {
    still_steps_ = 0;
    still_since_ = fitness_[best];
  }
}

const models::Position& Swarm::attractor(std::size_t particle) const {
  if (settings_.topology == Topology::roulette) {
    const auto word = random_.words(Draw::roulette, round_, static_cast<std::uint32_t>(steps_), static_cast<std::uint32_t>(particle))[0];
    kernels::Reused<double> shares(list_.size());
    std::transform(list_.begin(), list_.end(), shares.begin(), [](const GlobalBest& g) { return g.fitness; });
    return list_[roulette(shares, Random::unit(word))].position;
  }
  const std::size_t m = positions_.size();
  std::size_t best = particle;
  for (int k = -settings_.ring_radius; k <= settings_.ring_radius; ++k) {
    const auto shift = static_cast<std::size_t>(k + static_cast<int>(m));
    const std::size_t other = (particle + shift) % m;
    if (own_fitness_[other] < own_fitness_[best]) best = other;
  }
  return own_best_[best];
}

kernels::FitnessEvaluator* Swarm::workers() const noexcept {
  const bool worth_waking = settings_.threads != 1 && space_.costly_samples();
  return evaluator_ != nullptr && (worth_waking || evaluator_->shares(positions_.size())) ? evaluator_ : nullptr;
}

void Swarm::put_at_samples(const Sampler& sampler, std::span<const Sampler::Ask> asks, std::span<std::uint8_t> placed) {
  kernels::Reused<models::Position> thetas(asks.size());
  sampler.draw(asks, round_, static_cast<std::uint32_t>(steps_), thetas, placed);
  for (std::size_t k = 0; k < asks.size(); ++k) {
    if (placed[k] != 0) positions_[asks[k].particle] = thetas[k];
  }
}

void Swarm::move(const Sampler& sampler) {
  if (together_) return fly_together();
  for_particles([&](std::size_t first, std::size_t last) {
    kernels::Reused<Sampler::Ask> asks;
    for (std::size_t j = first; j < last; ++j) {
      if (is_renewed(j)) asks.push_back({static_cast<std::uint32_t>(j), (j & 1U) != 0 && settings_.local_share > 0});
    }
    kernels::Reused<std::uint8_t> placed(asks.size());
    put_at_samples(sampler, asks, placed);
    for (std::size_t j = first, k = 0; j < last; ++j) {
      const bool asked = k < asks.size() && asks[k].particle == j;
      if (asked && placed[k++] != 0) {
        velocities_[j].setZero();
      } else {
        fly(j);
      }
    }
  });
}

void Swarm::fly_together() {
  using Row = kernels::HyperplaneFlight::Row;
  kernels::HyperplaneFlight& flight = *together_;
  const std::size_t width = flight.axes() + 1;
  const auto put = [&](Row row, std::size_t j, const models::Position& values) {
    for (std::size_t d = 0; d < width; ++d) flight.row(row, d)[j] = values[static_cast<Eigen::Index>(d)];
  };
  const double own = chi_ * settings_.cognitive, best = chi_ * settings_.social;
  for (std::size_t j = 0; j < positions_.size(); ++j) {
    put(Row::position, j, positions_[j]);
    put(Row::velocity, j, velocities_[j]);
    put(Row::own, j, own_best_[j]);
    put(Row::best, j, attractor(j));
    // Half a word tells r1 and another r2: as even as a flight can show, for half the random numbers.
    const auto words = factors(j, 0);
    for (std::size_t d = 0; d < width; ++d) {
      flight.row(Row::pull_own, d)[j] = own * Random::unit(words[d]);
      flight.row(Row::pull_best, d)[j] = best * Random::unit(words[d] << 16);
    }
  }
  flight.step(chi_ * settings_.inertia);  // Eq. (1)
  for (std::size_t j = 0; j < positions_.size(); ++j) {
    for (std::size_t d = 0; d < width; ++d) {
      positions_[j][static_cast<Eigen::Index>(d)] = flight.row(Row::position, d)[j];
      velocities_[j][static_cast<Eigen::Index>(d)] = flight.row(Row::velocity, d)[j];
    }
  }
}

std::array<std::uint32_t, 4> Swarm::factors(std::size_t j, std::size_t d) const {
  return random_.words(Draw::move, round_, static_cast<std::uint32_t>(steps_),
                       static_cast<std::uint32_t>(j) * 16 + static_cast<std::uint32_t>(d / 2));
}

bool Swarm::is_renewed(std::size_t j) const noexcept {
  const std::size_t m = positions_.size();
  const auto renewed = static_cast<std::size_t>(settings_.renewal_share * static_cast<double>(m));
  // The renewed places rotate through the ring, so that every neighbourhood is refreshed in turn.
  return renewed > 0 && (j + static_cast<std::size_t>(steps_) * renewed) % m < renewed;
}

void Swarm::fly(std::size_t j) {
  const auto width = static_cast<std::size_t>(space_.parameter_count());
  models::Position to_own(static_cast<Eigen::Index>(width)), to_best(static_cast<Eigen::Index>(width));
  space_.difference(positions_[j], own_best_[j], to_own);
  space_.difference(positions_[j], attractor(j), to_best);
  for (std::size_t d = 0; d < width; d += 2) {
    const auto words = factors(j, d);
    for (std::size_t e = d; e < std::min(d + 2, width); ++e) {
      const auto at = static_cast<Eigen::Index>(e);
      const double r1 = Random::unit(words[2 * (e - d)]), r2 = Random::unit(words[2 * (e - d) + 1]);
      velocities_[j][at] = chi_ * (settings_.inertia * velocities_[j][at] + settings_.cognitive * r1 * to_own[at] +
                                   settings_.social * r2 * to_best[at]);  // Eq. (1)
    }
  }
  const models::Position before = positions_[j];
  space_.move(positions_[j], velocities_[j]);
  if (!space_.admit(positions_[j])) {
    positions_[j] = before;
    velocities_[j].setZero();
  }
}

}  // namespace swarmfit::swarm
