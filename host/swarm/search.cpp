// One search: a swarm of each kind over what is left to explain, and what each comes to.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "host/swarm/multi_model.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;  // spread of the list of global bests, as a share of the scale, below which it is stable

/// In lanes: one addition need not wait for the one before.
double sum_of(std::span<const float> values) {
  constexpr std::size_t kLanes = 8;
  std::array<double, kLanes> lanes{};
  const std::size_t even = values.size() / kLanes * kLanes;
  for (std::size_t i = 0; i < even; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] += static_cast<double>(values[i + k]);
  }
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  for (std::size_t i = even; i < values.size(); ++i) sum += static_cast<double>(values[i]);
  return sum;
}

}  // namespace

double MultiModel::loss_of_nothing(std::span<const float> caps) const {
  if (settings_.deflation == Deflation::parametric && allowed_.empty()) {
    return settings_.threshold * static_cast<double>(part_searched_ ? part_.index().size() : points_.finite_count());
  }
  double sum = 0;
  if (settings_.deflation == Deflation::parametric) {
    for (std::size_t k = 0; k < searched().size(); ++k) {
      sum += points_.finite(searched().index(k)) ? static_cast<double>(searched().allowed_at(k)) : 0.0;
    }
    return sum;
  }
  return sum_of(part_searched_ ? std::span<const float>(part_caps_) : caps);
}

Background MultiModel::background(std::size_t kind, std::span<const float> caps) const {
  if (space(kind).type() != ModelType::circle2d || part_searched_) return {};
  constexpr double kLargest = std::numeric_limits<double>::max();
  Background evenly{0, {kLargest, kLargest}, {-kLargest, -kLargest}};
  double square = 0;
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (!points_.finite(i)) continue;
    const Eigen::Vector2d p = points_.point<2>(i);
    evenly.low = evenly.low.cwiseMin(p);
    evenly.high = evenly.high.cwiseMax(p);
    square += static_cast<double>(caps[i]) * static_cast<double>(caps[i]);
  }
  // A point d from the curve saves c - d: the square of its cap in all, on both sides, over the area.
  const double area = (evenly.high - evenly.low).prod() * points_.frame().scale;
  if (area > 0) evenly.per_length = square / area;
  return evenly;
}

Expected<bool> MultiModel::fly(Swarm& swarm, std::size_t kind, std::uint32_t round, std::span<const models::Position> seeds,
                               std::span<const float> caps, float alive) {
  // Normals bring neighbourhoods that are too close for a kind which has no use for them.
  const bool close = points_.dimension() > 3 || space(kind).needs_normals();
  Sampler sampler(points_, part_.index(), close ? neighbours_ : none_, space(kind), random_);
  std::vector<float> left, room;
  const bool shown = settings_.deflation == Deflation::residual;  // else the caps only tell what a model still explains
  if (!shown) part_.gather(caps, left);
  sampler.prefer_unexplained(levelled(shown ? part_caps_ : left, room, part_allowed_), alive);
  scale_ = loss_of_nothing(caps);
  swarm.share_work(evaluator_);
  if (settings_.deflation == Deflation::residual) landscapes_[kind].expect(background(kind, caps));
  if (!swarm.start(sampler, round, seeds)) {
    stop_reason_ = "complete: what is left determines no model";
    return false;
  }
  while (!swarm.converged() && swarm.steps() < settings_.iterations) {
    if (auto reason = interrupted()) {
      stop_reason_ = *reason;
      return false;
    }
    auto done = watch_ != nullptr ? watched_step(swarm, kind, sampler) : swarm.step(landscapes_[kind], sampler, scale_);
    if (!done) return tl::unexpected(done.error());
  }
  if (watch_ != nullptr) ++watch_->swarms;
  steps_ += static_cast<std::size_t>(swarm.steps());
  return true;
}

Expected<> MultiModel::watched_step(Swarm& swarm, std::size_t kind, const Sampler& sampler) {
  SwarmStep step;
  step.type = space(kind).type();
  step.swarm = watch_->swarms;
  step.step = static_cast<std::size_t>(swarm.steps());
  // Where particles are when they are scored: before they move on.
  const auto positions = swarm.positions();
  step.positions.resize(space(kind).parameter_count(), static_cast<Eigen::Index>(positions.size()));
  for (std::size_t j = 0; j < positions.size(); ++j)
    step.positions.col(static_cast<Eigen::Index>(j)) = space(kind).to_data(positions[j], points_.frame());
  if (auto done = swarm.step(landscapes_[kind], sampler, scale_); !done) return done;
  step.fitness.assign(swarm.fitness().begin(), swarm.fitness().end());
  step.best = space(kind).to_data(swarm.best(), points_.frame());
  step.best_fitness = swarm.best_fitness();
  step.nothing_explained = scale_;
  watch_->observer(step);
  return {};
}

Expected<MultiModel::Outcome> MultiModel::explore(std::uint32_t round, std::span<const models::Position> seeds, Candidate& candidate) {
  Settings settings = kinds_[candidate.kind].settings;
  if (eager_ && settings.eager_stall > 0) settings.stall = std::min(settings.stall, settings.eager_stall);
  Swarm swarm(space(candidate.kind), settings, random_);
  auto flown = fly(swarm, candidate.kind, round, seeds, caps_, kUnexplained * tau_);
  if (!flown) return tl::unexpected(flown.error());
  if (!*flown) return Outcome::interrupted;
  candidate.theta = swarm.best();
  candidate.saving = swarm.saving();
  if (kinds_.size() > 1 && points_.has_normals()) {
    if (auto done = choose(swarm, candidate); !done) return tl::unexpected(done.error());
  }
  if (shares_out()) proposals_.insert(proposals_.end(), swarm.own_bests().begin(), swarm.own_bests().end());
  if (auto done = refine(candidate); !done) return tl::unexpected(done.error());
  if (pays(candidate.support, settings, space(candidate.kind).minimal_sample())) return Outcome::found;
  const auto& list = swarm.global_bests();
  const bool stable = list.front().fitness - list.back().fitness < kStable * scale_;
  return settings_.deflation == Deflation::parametric && stable ? Outcome::complete : Outcome::unpaid;
}

Expected<MultiModel::Outcome> MultiModel::search(const Seeds& seeds, Candidate& best) {
  Outcome reached = Outcome::interrupted;
  steps_ = 0;
  for (std::size_t kind = 0; kind < asked_; ++kind) {
    Candidate candidate;
    candidate.kind = kind;
    auto outcome = explore(round_++, seeds[kind], candidate);
    if (!outcome) return outcome;
    if (*outcome == Outcome::interrupted) {
      if (interrupted()) return outcome;
      continue;  // what is left determines no model of this kind
    }
    if (reached == Outcome::interrupted || (*outcome == Outcome::found && (reached != Outcome::found || worth(candidate) > worth(best)))) {
      best = std::move(candidate);
    }
    reached = std::max(reached, *outcome);
  }
  if (reached != Outcome::interrupted) stop_reason_.clear();
  if (kinds_.size() > 1 && reached == Outcome::found) {
    Candidate rejected = best;
    auto contested = contest(best);
    if (!contested || *contested != Outcome::unpaid || points_.dimension() != 3) return contested;
    // What seemed to pay is nothing of its own. Something flat may be in the way; else its points are, and the search goes on elsewhere.
    if (hides_flat()) {
      auto flat = look_flat(best, Outcome::unpaid);
      if (!flat || *flat != Outcome::unpaid) return flat;
    }
    best = std::move(rejected);
    return Outcome::rejected;
  }
  if (hides_flat() && reached <= Outcome::unpaid) return look_flat(best, reached);
  return reached;
}

}  // namespace swarmfit::swarm
