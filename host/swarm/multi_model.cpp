#include "host/swarm/multi_model.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/swarm/labelling.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/payment.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kAlike = 0.02;  // share of their saving by which the bests of two swarms that found the same may differ

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

MultiModel::~MultiModel() = default;

void MultiModel::restore_caps() {
  caps_.resize(points_.size());
  for (std::size_t i = 0; i < caps_.size(); ++i) caps_[i] = points_.finite(i) ? ground_.allowed_at(i) : 0.0F;
}

std::span<const float> MultiModel::levelled(std::span<const float> values, std::vector<float>& room) const {
  return levelled(values, room, allowed_);
}

std::span<const float> MultiModel::levelled(std::span<const float> values, std::vector<float>& room, std::span<const float> allowed) const {
  if (allowed.empty()) return values;
  room.resize(values.size());
  for (std::size_t i = 0; i < room.size(); ++i) room[i] = values[i] * (tau_ / allowed[i]);
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

kernels::Effort MultiModel::effort() const noexcept {
  const kernels::Effort now = evaluator_.effort(), &before = effort_before_, &beside = effort_beside_;
  return {now.evaluations - before.evaluations + beside.evaluations, now.point_models - before.point_models + beside.point_models,
          now.touched - before.touched + beside.touched};
}

void MultiModel::count_effort(FitResult& result) const {
  const auto [evaluations, point_models, touched] = effort();
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
  stopped_by_caller_ = !*go_on;
  if (stopped_by_caller_) stop_reason_ = "stopped by the caller";
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

MultiModel::Seeds MultiModel::seeds_from(const std::vector<Model>& warm_start) const {
  Seeds seeds(kinds_.size());
  for (const Model& model : warm_start) {
    for (std::size_t kind = 0; kind < asked_; ++kind) {
      if (space(kind).type() != model.type || space(kind).parameter_count() != model.parameters.size()) continue;
      models::Position theta = space(kind).from_data(model.parameters, points_.frame());
      if (space(kind).admit(theta)) seeds[kind].push_back(std::move(theta));
    }
  }
  return seeds;
}

Expected<> MultiModel::run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                           std::span<const Known> known) {
  if (auto done = look_for_models(on_model, warm_start, result, known); !done) return done;
  return conclude(on_model, result);
}

Expected<> MultiModel::look_for_models(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                                       std::span<const Known> known) {
  if (points_set_) {
    effort_before_ = evaluator_.effort();
  } else if (auto done = evaluator_.set_points(searched().view()); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  restore_caps();  // not before: setting points takes most of the memory
  if (auto done = show(caps_); !done) return done;
  const Seeds seeds = seeds_from(warm_start);
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
      if (auto done = set_aside(best); !done) return done;
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
  if (!ends_jointly() || !shares_out()) return {};
  if (auto done = polish(); !done) return done;
  return share_out();
}

bool MultiModel::ends_jointly() const {
  return settings_.joint && !limits_.stop.stop_requested() && (!found_.empty() || (shares_out() && !full()));
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

}  // namespace swarmfit::swarm
