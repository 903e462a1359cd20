#include "host/swarm/multi_model.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/swarm/payment.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStandsOut = 0.2;  // share of the cloud that a plane holds which is taken before other kinds are looked for
constexpr double kAlike = 0.02;     // share of their saving by which the bests of two swarms that found the same may differ

}  // namespace

MultiModel::MultiModel(kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, const models::WorkingPoints& points,
                       const Part& part, std::uint64_t seed, Limits limits, std::span<const float> spread)
    : problem_(evaluator, kinds, points, part, seed, spread),
      left_(problem_),
      pilot_(problem_, left_, std::move(limits)),
      candidates_(problem_, left_),
      search_(problem_, left_, pilot_, candidates_),
      contest_(problem_, left_, pilot_, candidates_, search_),
      polish_(problem_, left_, pilot_) {}

Expected<> MultiModel::run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                           std::span<const Known> known) {
  if (auto done = look_for_models(on_model, warm_start, result, known); !done) return done;
  return conclude(on_model, result);
}

Expected<> MultiModel::prepare() {
  if (points_set_) {
    effort_before_ = problem_.evaluator.effort();
  } else if (auto done = problem_.evaluator.set_points(problem_.searched().view()); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  left_.restore();  // not before: setting points takes most of the memory
  return left_.show();
}

Expected<> MultiModel::look_for_models(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                                       std::span<const Known> known) {
  if (auto done = prepare(); !done) return done;
  const Seeds seeds = seeds_from(warm_start);
  for (const Known& model : known) {
    if (!pilot_.why_ended().empty() || pilot_.interrupted() || full()) break;
    if (auto done = adopt(model, on_model, result); !done) return done;
  }
  if (learn_) {
    if (auto done = take_planes_that_stand_out(seeds, on_model, result); !done) return done;
    if (pilot_.why_ended().empty() && !pilot_.interrupted() && !full()) learn_(left_.part_caps());
  }
  if (auto done = look_round_by_round(seeds, on_model, result); !done) return done;
  result.stop_reason = pilot_.why_ended();
  if (!ends_jointly() || !problem_.shares_out()) return {};
  if (auto done = polish_.refine(found_, hidden_); !done) return done;
  share_out_ = std::make_unique<ShareOut>(problem_, left_, pilot_, candidates_);
  if (auto done = share_out_->run(found_, search_.proposals()); !done) return done;
  if (auto why = pilot_.interrupted()) result.stop_reason = *why;
  return {};
}

Expected<> MultiModel::take_planes_that_stand_out(const Seeds& seeds, const ModelCallback& on_model, FitResult& result) {
  std::size_t plane = 0;
  while (plane < problem_.kinds.size() && problem_.space(plane).type() != ModelType::plane) ++plane;
  if (plane == problem_.kinds.size() || !problem_.allowed.empty()) return {};  // where each point has a threshold none is known to lie flat
  const bool hidden = problem_.kinds[plane].hidden;
  const Worth worth(problem_, left_);
  const double much = kStandsOut * static_cast<double>(problem_.points.finite_count());
  while (pilot_.why_ended().empty() && !full()) {
    Candidate candidate;
    candidate.kind = plane;
    pilot_.set_steps(0);
    auto outcome = search_.explore(pilot_.next_round(), seeds[plane], candidate);
    if (!outcome) return tl::unexpected(outcome.error());
    if (*outcome == Outcome::interrupted && !pilot_.interrupted()) pilot_.go_on();  // what is left may yet determine another kind
    if (*outcome != Outcome::found || static_cast<double>(candidate.support.inliers()) < much || !worth.lies_flat(candidate)) return {};
    if (auto done = take(candidate, hidden ? Outcome::flat : Outcome::found, on_model, result); !done) return done;
  }
  return {};
}

Expected<> MultiModel::look_round_by_round(const Seeds& seeds, const ModelCallback& on_model, FitResult& result) {
  static constexpr const char* kNothingPays = "complete: no further model pays for itself";
  int unpaid = 0;
  double saving = 0;
  search_.end_soon(problem_.settings.eager_stall > 0 && !problem_.part_searched);
  while (pilot_.why_ended().empty()) {
    if (full()) {
      pilot_.end("max-models reached");
      break;
    }
    if (too_few_left()) {
      pilot_.end(kNothingPays);
      break;
    }
    Candidate best;
    auto outcome = search(seeds, best);
    if (!outcome) return tl::unexpected(outcome.error());
    if (*outcome == Outcome::interrupted) {
      // It may have been after the last swarm had come to its end.
      if (auto why = pilot_.interrupted(); why && pilot_.why_ended().empty()) pilot_.end(*why);
      break;
    }
    if (*outcome == Outcome::found || *outcome == Outcome::flat) {
      unpaid = 0;
      auto done = *outcome == Outcome::found ? take_found(best, on_model, result) : take(best, *outcome, on_model, result);
      if (!done) return done;
      continue;
    }
    if (*outcome == Outcome::rejected) {
      if (auto done = contest_.set_aside(best); !done) return done;
      continue;
    }
    if (search_.ends_soon()) {
      search_.end_soon(false);  // what is not found at once is looked for at length
      continue;
    }
    if (problem_.settings.deflation == Deflation::parametric) pilot_.landscape(best.kind).deflate_around(best.theta);
    if (*outcome == Outcome::complete) {
      pilot_.end("complete: the list of global bests is stable");
    } else if (++unpaid >= problem_.settings.patience || (unpaid > 1 && agree(best.saving, saving))) {
      pilot_.end(kNothingPays);
    }
    search_.look_harder(unpaid);
    saving = best.saving;
  }
  return {};
}

Expected<Outcome> MultiModel::search_each(const Seeds& seeds, Candidate& best) {
  Outcome reached = Outcome::interrupted;
  pilot_.set_steps(0);
  const Worth worth(problem_, left_);
  for (std::size_t kind = 0; kind < problem_.asked; ++kind) {
    Candidate candidate;
    candidate.kind = kind;
    auto outcome = search_.explore(pilot_.next_round(), seeds[kind], candidate);
    if (!outcome) return outcome;
    if (*outcome == Outcome::interrupted) {
      if (pilot_.interrupted()) return outcome;
      continue;  // what is left determines no model of this kind
    }
    const bool better = *outcome == Outcome::found && (reached != Outcome::found || worth.of(candidate) > worth.of(best));
    if (reached == Outcome::interrupted || better) best = std::move(candidate);
    reached = std::max(reached, *outcome);
  }
  if (reached != Outcome::interrupted) pilot_.go_on();
  return reached;
}

Expected<Outcome> MultiModel::search(const Seeds& seeds, Candidate& best) {
  auto reached = search_each(seeds, best);
  if (!reached || (*reached == Outcome::interrupted && pilot_.interrupted())) return reached;
  if (problem_.kinds.size() > 1 && *reached == Outcome::found) {
    Candidate rejected = best;
    auto contested = contest_.hold(best);
    if (!contested || *contested != Outcome::unpaid || problem_.points.dimension() != 3) return contested;
    // What seemed to pay is nothing of its own. Something flat may be in the way; else its points are, and the search goes on elsewhere.
    if (problem_.hides_flat()) {
      auto flat = contest_.look_flat(best, Outcome::unpaid);
      if (!flat || *flat != Outcome::unpaid) return flat;
    }
    best = std::move(rejected);
    return Outcome::rejected;
  }
  if (problem_.hides_flat() && *reached <= Outcome::unpaid) return contest_.look_flat(best, *reached);
  return reached;
}

MultiModel::Seeds MultiModel::seeds_from(const std::vector<Model>& warm_start) const {
  Seeds seeds(problem_.kinds.size());
  for (const Model& model : warm_start) {
    for (std::size_t kind = 0; kind < problem_.asked; ++kind) {
      if (problem_.space(kind).type() != model.type || problem_.space(kind).parameter_count() != model.parameters.size()) continue;
      models::Position theta = problem_.space(kind).from_data(model.parameters, problem_.points.frame());
      if (problem_.space(kind).admit(theta)) seeds[kind].push_back(std::move(theta));
    }
  }
  return seeds;
}

Expected<> MultiModel::adopt(const Known& known, const ModelCallback& on_model, FitResult& result) {
  Candidate candidate;
  candidate.kind = known.kind;
  candidate.theta = known.theta;
  pilot_.set_steps(known.iterations);
  if (auto done = candidates_.refine(candidate); !done) return done;
  if (!candidates_.pays(candidate)) return {};
  Outcome outcome = Outcome::found;
  if (problem_.kinds.size() > 1) {
    auto contested = contest_.hold(candidate);
    if (!contested) return tl::unexpected(contested.error());
    outcome = *contested;
  }
  if (outcome != Outcome::found && outcome != Outcome::flat) return {};
  return take(candidate, outcome, on_model, result);
}

Expected<> MultiModel::take(const Candidate& candidate, Outcome outcome, const ModelCallback& on_model, FitResult& result) {
  if (outcome == Outcome::found) {
    stopped_by_caller_ = !accept(candidate, on_model, result);
  } else {
    hidden_.push_back({&problem_.space(candidate.kind), candidate.theta});
  }
  contest_.found();
  if (auto done = candidates_.deflate(candidate); !done) return done;
  if (stopped_by_caller_) pilot_.end("stopped by the caller");
  return {};
}

Expected<> MultiModel::take_found(Candidate& candidate, const ModelCallback& on_model, FitResult& result) {
  auto other = candidates_.come_apart(candidate);
  if (!other) return tl::unexpected(other.error());
  if (auto done = take(candidate, Outcome::found, on_model, result); !done || !*other) return done;
  if (!pilot_.why_ended().empty() || full()) return {};
  Candidate rest;
  rest.theta = **other;
  pilot_.set_steps(0);
  if (auto done = candidates_.look(rest, problem_.full_rounds()); !done) return done;
  return candidates_.pays(rest) ? take_found(rest, on_model, result) : Expected<>();
}

bool MultiModel::accept(const Candidate& candidate, const ModelCallback& on_model, FitResult& result) {
  const std::size_t evaluations_before = result.evaluations;
  count_effort(result);
  Model model;
  model.type = problem_.space(candidate.kind).type();
  model.parameters = problem_.space(candidate.kind).to_data(candidate.theta, problem_.points.frame());
  model.cost = candidate.loss * problem_.settings.stands_for;
  model.iterations = pilot_.steps();
  model.evaluations = result.evaluations - evaluations_before;
  model.points_touched = result.points_touched;
  model.found_at_ms = pilot_.elapsed_ms();
  const auto inliers = static_cast<double>(candidate.support.inliers());
  model.inliers = static_cast<std::size_t>(std::lround(inliers * problem_.settings.stands_for));
  model.rms = inliers > 0 ? std::sqrt(candidate.support.square / inliers) : 0.0;
  found_.push_back({&problem_.space(candidate.kind), candidate.theta});
  result.models.push_back(std::move(model));
  result.iterations += pilot_.steps();
  if (problem_.settings.deflation == Deflation::parametric) pilot_.landscape(candidate.kind).deflate_around(candidate.theta);
  return !on_model || on_model(result.models.back()) == Verdict::go_on;
}

Expected<> MultiModel::conclude(const ModelCallback& on_model, FitResult& result, std::span<const models::Placed> others,
                                const kernels::Effort& effort) {
  effort_beside_ = effort;
  if (share_out_ != nullptr) return share_out(on_model, result, others);
  if (ends_jointly()) {
    if (auto done = polish_.refine(found_, hidden_); !done) return done;
    // With many points the polished models are where the joint refit would leave them.
    if (!problem_.part_searched) {
      if (auto energy = refine_jointly(problem_.ground, found_); !energy) return tl::unexpected(energy.error());
    }
    if (auto done = polish_.drop_unpaid(found_, result.models); !done) return done;
    tell_parameters(result);
    if (problem_.labels_locally()) {
      auto labels = polish_.label(found_, hidden_);
      if (!labels) return tl::unexpected(labels.error());
      labels_ = std::move(*labels);
    }
  }
  count_effort(result);
  return {};
}

Expected<> MultiModel::share_out(const ModelCallback& on_model, FitResult& result, std::span<const models::Placed> others) {
  const auto made = share_out_->conclude(others, found_, result.models);
  if (!made) return tl::unexpected(made.error());
  count_effort(result);
  if (found_.empty()) return {};
  labels_ = share_out_->labels();
  tell_parameters(result);
  for (std::size_t m = 0; m < found_.size(); ++m) {
    if (!(*made)[m] || !on_model || stopped_by_caller_) continue;
    stopped_by_caller_ = on_model(result.models[m]) == Verdict::stop;
  }
  return {};
}

void MultiModel::tell_parameters(FitResult& result) const {
  for (std::size_t m = 0; m < found_.size(); ++m) {
    result.models[m].parameters = found_[m].space->to_data(found_[m].theta, problem_.points.frame());
  }
}

kernels::Effort MultiModel::effort() const noexcept {
  const kernels::Effort now = problem_.evaluator.effort(), &before = effort_before_, &beside = effort_beside_;
  return {now.evaluations - before.evaluations + beside.evaluations, now.point_models - before.point_models + beside.point_models,
          now.touched - before.touched + beside.touched};
}

void MultiModel::count_effort(FitResult& result) const {
  const auto [evaluations, point_models, touched] = effort();
  result.evaluations = static_cast<std::size_t>(evaluations);
  const double whole =
      static_cast<double>(evaluations) * static_cast<double>(problem_.points.finite_count()) * problem_.settings.stands_for;
  result.points_touched = whole > 0 ? static_cast<double>(touched) / whole : 1.0;
}

bool MultiModel::ends_jointly() const {
  return problem_.settings.joint && !pilot_.limits().stop.stop_requested() && (!found_.empty() || (problem_.shares_out() && !full()));
}

bool MultiModel::too_few_left() const {
  // The paper's swarms end by themselves; and where labels are shared out, what a swarm in vain came to is on offer as well.
  if (problem_.settings.deflation == Deflation::parametric || problem_.shares_out() || problem_.kinds.size() > 1) return false;
  const double wanted = (problem_.may_share(0) ? kOwnShare : 1.0) * static_cast<double>(problem_.settings.min_inliers);
  return static_cast<double>(left_.count()) < wanted;
}

bool MultiModel::agree(double saving, double before) const noexcept {
  return !problem_.shares_out() && problem_.kinds.size() == 1 && std::abs(saving - before) <= kAlike * std::max(saving, before);
}

}  // namespace swarmfit::swarm
