#include "host/swarm/multi_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "host/swarm/deflation.hpp"
#include "host/swarm/labelling.hpp"
#include "host/swarm/local_labels.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/split.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;                    // spread of the list of global bests, as a share of the scale, below which it is stable
constexpr double kAlike = 0.02;                     // share of their saving by which the bests of two swarms that found the same may differ
constexpr int kFullRounds = 1;                      // of refinement on all points, where it was done on a part of them before
constexpr std::size_t kRun = std::size_t{1} << 18;  // points whose distances are in memory at a time

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

MultiModel::MultiModel(kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, const models::WorkingPoints& points,
                       const Part& part, std::uint64_t seed, Limits limits, std::span<const float> spread)
    : evaluator_(evaluator),
      kinds_(kinds),
      asked_(static_cast<std::size_t>(std::count_if(kinds.begin(), kinds.end(), [](const Kind& kind) { return !kind.hidden; }))),
      points_(points),
      settings_(kinds.front().settings),
      random_(seed),
      limits_(std::move(limits)),
      part_(part.points),
      neighbours_(part.neighbours),
      part_searched_(settings_.searches_part(points.finite_count())),
      tau_(static_cast<float>(settings_.threshold)),
      allowed_(allowed_by(spread, tau_)),
      ground_{.evaluator = evaluator, .space = *kinds.front().space, .points = points, .tau = tau_, .allowed = allowed_},
      part_ground_{.evaluator = evaluator, .space = *kinds.front().space, .points = points, .tau = tau_, .part = &part_} {
  if (!allowed_.empty()) part_.gather(allowed_, part_allowed_);
  part_ground_.allow(part_allowed_);
  for (const Kind& kind : kinds_) landscapes_.emplace_back(evaluator, *kind.space, points.frame(), kind.settings);
}

void MultiModel::restore_caps() {
  caps_.resize(points_.size());
  for (std::size_t i = 0; i < caps_.size(); ++i) caps_[i] = points_.finite(i) ? ground_.allowed_at(i) : 0.0F;
}

std::span<const float> MultiModel::levelled(std::span<const float> values, std::vector<float>& room) const {
  if (allowed_.empty()) return values;
  room.resize(values.size());
  for (std::size_t i = 0; i < room.size(); ++i) room[i] = values[i] * (tau_ / allowed_[i]);
  return room;
}

double MultiModel::elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - limits_.start).count(); }

std::optional<std::string> MultiModel::interrupted() const {
  if (limits_.stop.stop_requested()) return "cancelled";
  if (limits_.budget_ms > 0 && elapsed_ms() >= limits_.budget_ms) return "time budget used up";
  return std::nullopt;
}

Expected<> MultiModel::show(std::span<const float> caps) {
  part_.gather(caps, part_caps_);
  if (auto done = evaluator_.set_caps(part_searched_ ? part_caps_ : caps); !done) return tl::unexpected(to_error(done.error()));
  return {};
}

void MultiModel::count_effort(FitResult& result) const {
  const kernels::Effort effort = evaluator_.effort();
  const std::uint64_t evaluations = effort.evaluations - effort_before_.evaluations, touched = effort.touched - effort_before_.touched;
  result.evaluations = static_cast<std::size_t>(evaluations);
  const double whole = static_cast<double>(evaluations) * static_cast<double>(points_.finite_count()) * settings_.stands_for;
  result.points_touched = whole > 0 ? static_cast<double>(touched) / whole : 1.0;
}

Expected<> MultiModel::take(const Candidate& candidate, Outcome outcome, const ModelCallback& on_model, FitResult& result) {
  const bool kept = outcome == Outcome::found;
  auto go_on = kept ? accept(candidate, on_model, result) : Expected<bool>(true);
  if (!go_on) return tl::unexpected(go_on.error());
  if (!kept) hidden_.push_back({&space(candidate.kind), candidate.theta});
  looked_flat_ = false;
  if (auto done = deflate(candidate); !done) return done;
  if (!*go_on) stop_reason_ = "stopped by the caller";
  return {};
}

Expected<> MultiModel::take_found(Candidate& candidate, const ModelCallback& on_model, FitResult& result) {
  auto other = come_apart(candidate);
  if (!other) return tl::unexpected(other.error());
  if (auto done = take(candidate, Outcome::found, on_model, result); !done || !*other) return done;
  if (!stop_reason_.empty() || full()) return {};
  Candidate rest;
  rest.theta = **other;
  steps_ = 0;
  if (auto done = look(rest, full_rounds()); !done) return done;
  return pays(rest.support, settings_, space(0).minimal_sample()) ? take_found(rest, on_model, result) : Expected<>();
}

Expected<std::optional<models::Position>> MultiModel::come_apart(Candidate& candidate) {
  const bool flat = kinds_.size() == 1 && space(0).type() == ModelType::plane && settings_.deflation == Deflation::residual;
  if (!flat || !part_searched_ || !settings_.refine || !allowed_.empty() || !looks_loose(candidate.support, settings_.threshold)) {
    return std::nullopt;
  }
  const Suspect suspect{candidate.theta, candidate.distances, caps_, settings_.min_inliers};
  const auto pair = crossing_pair(part_ground_, suspect, random_, splits_++);
  if (!pair) return tl::unexpected(pair.error());
  if (!*pair) return std::nullopt;
  std::array<Candidate, 2> halves;
  for (std::size_t k = 0; k < halves.size(); ++k) {
    halves[k].theta = (**pair)[k];
    if (auto done = look(halves[k], 0); !done) return tl::unexpected(done.error());
  }
  std::vector<float> both = halves[0].distances;
  take_nearer(halves[1].distances, both);
  if (!(saved(caps_, both) > saved(caps_, candidate.distances))) return std::nullopt;
  const std::size_t larger = halves[0].support.inliers() < halves[1].support.inliers() ? 1 : 0;
  Candidate &one = halves[larger], &other = halves[1 - larger];
  // Both must pay, the second by what the first leaves it.
  const int sample = space(0).minimal_sample();
  if (!pays(one.support, settings_, sample)) return std::nullopt;
  std::vector<float> caps = caps_;
  Near near = near_;
  if (auto done = sink(one, caps, near); !done) return tl::unexpected(done.error());
  if (auto done = count(other, caps, near); !done) return tl::unexpected(done.error());
  if (!pays(other.support, settings_, sample)) return std::nullopt;
  one.saving = candidate.saving;
  candidate = std::move(one);
  return std::move(other.theta);
}

Expected<> MultiModel::adopt(const Known& known, const ModelCallback& on_model, FitResult& result) {
  Candidate candidate;
  candidate.kind = known.kind;
  candidate.theta = known.theta;
  steps_ = known.iterations;
  if (auto done = refine(candidate); !done) return done;
  if (!pays(candidate.support, kinds_[known.kind].settings, space(known.kind).minimal_sample())) return {};
  Outcome outcome = Outcome::found;
  if (kinds_.size() > 1) {
    auto contested = contest(candidate);
    if (!contested) return tl::unexpected(contested.error());
    outcome = *contested;
  }
  if (outcome != Outcome::found && outcome != Outcome::flat) return {};
  return take(candidate, outcome, on_model, result);
}

Expected<> MultiModel::run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                           std::span<const Known> known) {
  if (points_set_) {
    effort_before_ = evaluator_.effort();
  } else if (auto done = evaluator_.set_points(searched().view()); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  restore_caps();  // not before: setting points takes most of the memory
  if (auto done = show(caps_); !done) return done;
  Seeds seeds(kinds_.size());
  for (const Model& model : warm_start) {
    for (std::size_t kind = 0; kind < asked_; ++kind) {
      if (space(kind).type() != model.type || space(kind).parameter_count() != model.parameters.size()) continue;
      models::Position theta = space(kind).from_data(model.parameters, points_.frame());
      if (space(kind).admit(theta)) seeds[kind].push_back(std::move(theta));
    }
  }
  for (const Known& model : known) {
    if (!stop_reason_.empty() || interrupted() || full()) break;
    if (auto done = adopt(model, on_model, result); !done) return done;
  }
  static constexpr const char* kNothingPays = "complete: no further model pays for itself";
  int unpaid = 0;
  double saving = 0;
  eager_ = settings_.eager_stall > 0 && !part_searched_;
  while (stop_reason_.empty()) {
    if (full()) {
      stop_reason_ = "max-models reached";
      break;
    }
    if (too_few_left()) {
      stop_reason_ = kNothingPays;
      break;
    }
    Candidate best;
    auto outcome = search(seeds, best);
    if (!outcome) return tl::unexpected(outcome.error());
    if (*outcome == Outcome::interrupted) break;
    if (*outcome == Outcome::found || *outcome == Outcome::flat) {
      unpaid = 0;
      if (auto done = *outcome == Outcome::found ? take_found(best, on_model, result) : take(best, *outcome, on_model, result); !done)
        return done;
      continue;
    }
    if (*outcome == Outcome::rejected) {
      constexpr int kNoTail = 1;
      swarm::deflate(best.distances, tau_, kNoTail, settings_.dead_zone_slope, caps_, allowed_);
      if (auto done = show(caps_); !done) return done;
      continue;
    }
    if (std::exchange(eager_, false)) continue;  // what is not found at once is looked for at length
    if (settings_.deflation == Deflation::parametric) landscapes_[best.kind].deflate_around(best.theta);
    if (*outcome == Outcome::complete) {
      stop_reason_ = "complete: the list of global bests is stable";
    } else if (++unpaid >= settings_.patience || (unpaid > 1 && agree(best.saving, saving))) {
      stop_reason_ = kNothingPays;
    }
    saving = best.saving;
  }
  result.stop_reason = stop_reason_;
  return finish(result);
}

bool MultiModel::too_few_left() const {
  // The paper's swarms end by themselves; and where labels are shared out, what a swarm in vain came to is on offer as well.
  if (settings_.deflation == Deflation::parametric || shares_out() || kinds_.size() > 1) return false;
  std::size_t left = 0;
  for (std::size_t i = 0; i < caps_.size(); ++i) left += caps_[i] >= kUnexplained * ground_.allowed_at(i) ? 1 : 0;
  return static_cast<double>(left) < (may_share(0) ? kOwnShare : 1.0) * static_cast<double>(settings_.min_inliers);
}

bool MultiModel::agree(double saving, double before) const noexcept {
  return !shares_out() && kinds_.size() == 1 && std::abs(saving - before) <= kAlike * std::max(saving, before);
}

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
  std::vector<float> room;
  sampler.prefer_unexplained(levelled(caps, room), alive);
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

bool MultiModel::lists_distances() const noexcept { return points_.size() <= 4 * kRun || kinds_.size() > 1 || !allowed_.empty(); }

template <class Visit>
Expected<> MultiModel::in_runs(const Candidate& candidate, Visit&& visit) const {
  if (lists_distances()) {
    visit(std::size_t{0}, std::span<const float>(candidate.distances));
    return {};
  }
  std::vector<float> distances;
  for (std::size_t first = 0; first < points_.size(); first += kRun) {
    distances.resize(std::min(kRun, points_.size() - first));
    if (auto done = tell_distances(whole(candidate.kind), candidate.theta, first, distances); !done) return done;
    visit(first, std::span<const float>(distances));
  }
  return {};
}

int MultiModel::full_rounds() const noexcept { return part_searched_ ? kFullRounds : kMostRounds; }

Expected<> MultiModel::refine(Candidate& candidate) {
  models::Position& theta = candidate.theta;
  if (part_searched_ && settings_.refine) {
    const Ground part = part_ground_.of(space(candidate.kind));
    if (auto done = refine_one(part, settings_.loss, part_caps_, theta, kMostRounds); !done) return tl::unexpected(done.error());
  }
  return look(candidate, settings_.refine ? full_rounds() : 0);
}

Expected<> MultiModel::look(Candidate& candidate, int rounds) {
  auto least =
      refine_one(whole(candidate.kind), settings_.loss, caps_, candidate.theta, rounds, lists_distances() ? &candidate.distances : nullptr);
  if (!least) return tl::unexpected(least.error());
  candidate.loss = *least;
  return count(candidate, caps_, near_);
}

Expected<> MultiModel::count(Candidate& candidate, std::span<const float> caps, const Near& near) const {
  candidate.support = {};
  std::vector<float> caps_room, room;
  return in_runs(candidate, [&](std::size_t first, std::span<const float> distances) {
    const std::span<const float> here = caps.subspan(first, distances.size());
    const std::span<const std::uint8_t> beside = std::span(near.beside).subspan(near.beside.empty() ? 0 : first);
    const bool shares = may_share(candidate.kind) && !near.nearest.empty();
    const std::span<const float> nearest = shares ? std::span(near.nearest).subspan(first, distances.size()) : std::span<const float>();
    candidate.support = count_support(levelled(distances, room), levelled(here, caps_room), tau_, beside, candidate.support, nearest);
  });
}

Expected<bool> MultiModel::accept(const Candidate& candidate, const ModelCallback& on_model, FitResult& result) {
  const std::size_t evaluations_before = result.evaluations;
  count_effort(result);
  Model model;
  model.type = space(candidate.kind).type();
  model.parameters = space(candidate.kind).to_data(candidate.theta, points_.frame());
  model.cost = candidate.loss * settings_.stands_for;
  model.iterations = steps_;
  model.evaluations = result.evaluations - evaluations_before;
  model.points_touched = result.points_touched;
  model.found_at_ms = elapsed_ms();
  const auto inliers = static_cast<double>(candidate.support.inliers());
  model.inliers = static_cast<std::size_t>(std::lround(inliers * settings_.stands_for));
  model.rms = inliers > 0 ? std::sqrt(candidate.support.square / inliers) : 0.0;
  found_.push_back({&space(candidate.kind), candidate.theta});
  result.models.push_back(model);
  result.iterations += steps_;
  if (settings_.deflation == Deflation::parametric) landscapes_[candidate.kind].deflate_around(candidate.theta);
  return !on_model || on_model(result.models.back()) == Verdict::go_on;
}

Expected<> MultiModel::sink(const Candidate& candidate, std::vector<float>& caps, Near& near) const {
  near.beside.resize(points_.size());
  if (any_shares()) near.nearest.resize(points_.size(), std::numeric_limits<float>::infinity());
  std::vector<float> room, reaches;
  const int reach = tail_reach(candidate.support);
  if (lists_distances() && reach > 1 && space(candidate.kind).type() == ModelType::plane) {
    std::vector<float> caps_room;
    reaches = local_reach(points_, candidate.theta.head<3>(), levelled(candidate.distances, room), levelled(caps, caps_room), tau_, reach);
  }
  return in_runs(candidate, [&](std::size_t first, std::span<const float> distances) {
    const std::span<const float> level = levelled(distances, room);
    if (allowed_.empty() && reaches.empty()) {
      const kernels::Sinking how{beside_reach(tau_), static_cast<float>(reach) * tau_, static_cast<float>(settings_.dead_zone_slope)};
      const std::size_t n = distances.size();
      const auto nearest = std::span(near.nearest).subspan(near.nearest.empty() ? 0 : first, near.nearest.empty() ? 0 : n);
      return kernels::sink(distances, how, std::span(near.beside).subspan(first, n), nearest, std::span(caps).subspan(first, n));
    }
    mark_beside(level, tau_, std::span(near.beside).subspan(first, distances.size()));
    if (!near.nearest.empty()) take_nearer(level, std::span(near.nearest).subspan(first, distances.size()));
    swarm::deflate(distances, tau_, reach, settings_.dead_zone_slope, std::span(caps).subspan(first, distances.size()), allowed_, reaches);
  });
}

Expected<> MultiModel::deflate(const Candidate& candidate) {
  if (auto done = sink(candidate, caps_, near_); !done) return done;
  if (settings_.deflation == Deflation::parametric) return {};  // there the caps only tell what a model still explains
  return show(caps_);
}

Expected<> MultiModel::finish(FitResult& result) {
  if (settings_.joint && !limits_.stop.stop_requested() && (!found_.empty() || (shares_out() && !full()))) {
    if (auto done = polish(); !done) return done;
    if (shares_out()) return share_out(result);
    // With many points the polished models are where the joint refit would leave them.
    if (!part_searched_) {
      if (auto energy = refine_jointly(ground_, found_); !energy) return tl::unexpected(energy.error());
    }
    if (auto done = drop_unpaid(result); !done) return done;
    tell_parameters(result);
    if (labels_locally()) {
      if (auto done = share_out_locally(); !done) return done;
    }
  }
  count_effort(result);
  return {};
}

void MultiModel::tell_parameters(FitResult& result) const {
  for (std::size_t m = 0; m < found_.size(); ++m) result.models[m].parameters = found_[m].space->to_data(found_[m].theta, points_.frame());
}

bool MultiModel::labels_locally() const noexcept { return settings_.sharpen && !part_searched_ && points_.finite_count() <= kFewPoints; }

Expected<> MultiModel::share_out_locally() {
  std::vector<models::Placed> all = found_;
  if (hidden_owns()) all.insert(all.end(), hidden_.begin(), hidden_.end());
  auto distances = measure(ground_, all);
  if (!distances) return tl::unexpected(distances.error());
  std::vector<float> room;
  for (std::vector<float>& one : *distances) {
    if (levelled(one, room).data() == room.data()) one.swap(room);
  }
  labels_ = label_locally(points_, *distances, tau_);
  forget_beyond(found_.size(), labels_);
  return {};
}

Expected<> MultiModel::drop_unpaid(FitResult& result) {
  while (found_.size() > 1) {
    auto unique = unique_support(ground_, found_);
    if (!unique) return tl::unexpected(unique.error());
    const auto least = std::min_element(unique->begin(), unique->end());
    if (2 * *least >= settings_.min_inliers) return {};
    found_.erase(found_.begin() + (least - unique->begin()));
    result.models.erase(result.models.begin() + (least - unique->begin()));
    if (auto energy = refine_jointly(ground_, found_, full_rounds()); !energy) return tl::unexpected(energy.error());
  }
  return {};
}

}  // namespace swarmfit::swarm
