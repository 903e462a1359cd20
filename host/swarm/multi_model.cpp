#include "host/swarm/multi_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/swarm/deflation.hpp"
#include "host/swarm/labelling.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;      // spread of the list of global bests, as a share of the scale, below which it is stable
constexpr float kUnexplained = 0.5F;  // of tau: points whose cap is at least that are sampled from
constexpr int kMostRounds = 8;        // of refinement
constexpr float kSharper[] = {0.03F, 0.01F, 0.003F};  // corners, one after another, where points are few
constexpr int kFullRounds = 1;                        // of refinement on all points, where it was done on a part of them before

}  // namespace

MultiModel::MultiModel(kernels::FitnessEvaluator& evaluator, const models::ModelSpace& space, const models::WorkingPoints& points,
                       const Part& part, const Settings& settings, std::uint64_t seed, Limits limits)
    : evaluator_(evaluator),
      space_(space),
      points_(points),
      settings_(settings),
      random_(seed),
      limits_(std::move(limits)),
      part_(part.points),
      neighbours_(part.neighbours),
      part_searched_(settings.searches_part(points.finite_count())),
      landscape_(evaluator, space, points.frame(), settings),
      tau_(static_cast<float>(settings.threshold)),
      ground_{evaluator, space, points, tau_},
      part_ground_{evaluator, space, points, tau_, &part_},
      distances_(points.size()) {
  restore_caps();
}

void MultiModel::restore_caps() {
  caps_.resize(points_.size());
  for (std::size_t i = 0; i < caps_.size(); ++i) caps_[i] = points_.finite(i) ? tau_ : 0.0F;
}

double MultiModel::elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - limits_.start).count(); }

std::optional<std::string> MultiModel::interrupted() const {
  if (limits_.stop.stop_requested()) return "cancelled";
  if (limits_.budget_ms > 0 && elapsed_ms() >= limits_.budget_ms) return "time budget used up";
  return std::nullopt;
}

Expected<> MultiModel::show_caps() {
  part_.gather(caps_, part_caps_);
  if (auto done = evaluator_.set_caps(part_searched_ ? part_caps_ : caps_); !done) return tl::unexpected(to_error(done.error()));
  return {};
}

void MultiModel::count_effort(FitResult& result) const {
  const kernels::Effort effort = evaluator_.effort();
  result.evaluations = static_cast<std::size_t>(effort.evaluations);
  const double whole = static_cast<double>(effort.evaluations) * static_cast<double>(points_.finite_count()) * settings_.stands_for;
  result.points_touched = whole > 0 ? static_cast<double>(effort.touched) / whole : 1.0;
}

Expected<> MultiModel::run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result) {
  if (auto done = evaluator_.set_points(searched().view()); !done) return tl::unexpected(to_error(done.error()));
  if (auto done = show_caps(); !done) return done;
  std::vector<models::Position> seeds;
  for (const Model& model : warm_start) {
    models::Position theta = space_.from_data(model.parameters, points_.frame());
    if (space_.admit(theta)) seeds.push_back(std::move(theta));
  }
  int unpaid = 0;
  while (stop_reason_.empty()) {
    if (limits_.max_models > 0 && found_.size() >= limits_.max_models) {
      stop_reason_ = "max-models reached";
      break;
    }
    models::Position theta;
    double loss = 0;
    auto outcome = search(round_++, seeds, theta, loss);
    if (!outcome) return tl::unexpected(outcome.error());
    if (*outcome == Outcome::interrupted) break;
    if (*outcome == Outcome::found) {
      unpaid = 0;
      auto go_on = accept(theta, loss, on_model, result);
      if (!go_on) return tl::unexpected(go_on.error());
      if (!*go_on) stop_reason_ = "stopped by the caller";
      continue;
    }
    if (settings_.deflation == Deflation::parametric) landscape_.deflate_around(theta);
    if (*outcome == Outcome::complete) {
      stop_reason_ = "complete: the list of global bests is stable";
    } else if (++unpaid >= settings_.patience) {
      stop_reason_ = "complete: no further model pays for itself";
    }
  }
  result.stop_reason = stop_reason_;
  return finish(result);
}

double MultiModel::loss_of_nothing() const {
  if (settings_.deflation == Deflation::parametric) {
    return settings_.threshold * static_cast<double>(part_searched_ ? part_.index().size() : points_.finite_count());
  }
  double sum = 0;
  for (const float cap : part_searched_ ? part_caps_ : caps_) sum += static_cast<double>(cap);
  return sum;
}

Expected<bool> MultiModel::fly(Swarm& swarm, std::uint32_t round, std::span<const models::Position> seeds, float alive) {
  Sampler sampler(points_, part_.index(), neighbours_, space_, random_);
  sampler.prefer_unexplained(caps_, alive);
  scale_ = loss_of_nothing();
  steps_ = 0;
  if (!swarm.start(sampler, round, seeds)) {
    stop_reason_ = "complete: what is left determines no model";
    return false;
  }
  while (!swarm.converged() && swarm.steps() < settings_.iterations) {
    if (auto reason = interrupted()) {
      stop_reason_ = *reason;
      return false;
    }
    if (auto done = swarm.step(landscape_, sampler, scale_); !done) return tl::unexpected(done.error());
  }
  steps_ = static_cast<std::size_t>(swarm.steps());
  return true;
}

Expected<MultiModel::Outcome> MultiModel::search(std::uint32_t round, std::span<const models::Position> seeds, models::Position& theta,
                                                 double& loss) {
  Swarm swarm(space_, settings_, random_);
  auto flown = fly(swarm, round, seeds, kUnexplained * tau_);
  if (!flown) return tl::unexpected(flown.error());
  if (!*flown) return Outcome::interrupted;
  theta = swarm.best();
  if (shares_out()) proposals_.insert(proposals_.end(), swarm.own_bests().begin(), swarm.own_bests().end());
  if (auto done = refine(theta, loss); !done) return tl::unexpected(done.error());
  support_ = count_support(distances_, caps_, tau_, nearest_);
  if (pays(support_, settings_, space_.minimal_sample())) return Outcome::found;
  const auto& list = swarm.global_bests();
  const bool stable = list.front().fitness - list.back().fitness < kStable * scale_;
  return settings_.deflation == Deflation::parametric && stable ? Outcome::complete : Outcome::unpaid;
}

int MultiModel::full_rounds() const noexcept { return part_searched_ ? kFullRounds : kMostRounds; }

Expected<> MultiModel::refine(models::Position& theta, double& loss) {
  if (part_searched_ && settings_.refine) {
    if (auto done = refine_one(part_ground_, settings_.loss, part_caps_, theta, kMostRounds); !done) return tl::unexpected(done.error());
  }
  auto least = refine_one(ground_, settings_.loss, caps_, theta, settings_.refine ? full_rounds() : 0, &distances_);
  if (!least) return tl::unexpected(least.error());
  loss = *least;
  return {};
}

Expected<bool> MultiModel::accept(const models::Position& theta, double loss, const ModelCallback& on_model, FitResult& result) {
  const std::size_t evaluations_before = result.evaluations;
  count_effort(result);
  Model model;
  model.type = space_.type();
  model.parameters = space_.to_data(theta, points_.frame());
  model.cost = loss * settings_.stands_for;
  model.iterations = steps_;
  model.evaluations = result.evaluations - evaluations_before;
  model.points_touched = result.points_touched;
  model.found_at_ms = elapsed_ms();
  const auto inliers = static_cast<double>(support_.inliers());
  model.inliers = static_cast<std::size_t>(std::lround(inliers * settings_.stands_for));
  model.rms = inliers > 0 ? std::sqrt(support_.square / inliers) : 0.0;
  found_.push_back(theta);
  result.models.push_back(model);
  result.iterations += steps_;
  if (settings_.deflation == Deflation::parametric) landscape_.deflate_around(theta);
  if (auto done = deflate(); !done) return tl::unexpected(done.error());
  return !on_model || on_model(result.models.back()) == Verdict::go_on;
}

Expected<> MultiModel::deflate() {
  nearest_.resize(distances_.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < nearest_.size(); ++i) nearest_[i] = distances_[i] < nearest_[i] ? distances_[i] : nearest_[i];
  swarm::deflate(distances_, tau_, tail_reach(support_), settings_.dead_zone_slope, caps_);
  if (settings_.deflation == Deflation::parametric) return {};  // there the caps only tell what a model still explains
  return show_caps();
}

Expected<> MultiModel::finish(FitResult& result) {
  if (settings_.joint && !found_.empty() && !limits_.stop.stop_requested()) {
    if (auto done = polish(); !done) return done;
    if (shares_out()) return share_out(result);
    // With many points the polished models are where the joint refit would leave them.
    if (!part_searched_) {
      if (auto energy = refine_jointly(ground_, found_); !energy) return tl::unexpected(energy.error());
    }
    if (auto done = drop_unpaid(result); !done) return done;
    for (std::size_t m = 0; m < found_.size(); ++m) result.models[m].parameters = space_.to_data(found_[m], points_.frame());
  }
  count_effort(result);
  return {};
}

bool MultiModel::shares_out() const noexcept { return settings_.joint && !part_searched_ && settings_.prices.smoothness > 0; }

Expected<> MultiModel::search_further(Labelling& labelling) {
  // Swarms look for what lowers the joint energy: each point may still save what it costs now. Two models that the first search took for
  // one come apart here, and what was too little to be seen beside the large ones is seen.
  constexpr float kAnyPoint = 0;
  const std::string before = stop_reason_;
  while (!interrupted()) {
    std::fill(caps_.begin(), caps_.end(), 0.0F);
    labelling.costs(caps_);
    for (float& cap : caps_) cap *= tau_;
    if (auto done = show_caps(); !done) return done;
    Swarm swarm(space_, settings_, random_);
    auto flown = fly(swarm, round_++, {}, kAnyPoint);
    if (!flown) return tl::unexpected(flown.error());
    if (!*flown) {
      if (!interrupted()) stop_reason_ = before;
      return {};
    }
    models::Position theta = swarm.best();
    double loss = 0;
    if (auto done = refine(theta, loss); !done) return done;
    std::vector<models::Position> proposals(swarm.own_bests().begin(), swarm.own_bests().end());
    proposals.push_back(std::move(theta));
    auto joined = labelling.offer(proposals);
    if (!joined) return tl::unexpected(joined.error());
    if (!*joined) return {};
  }
  return {};
}

Expected<> MultiModel::share_out(FitResult& result) {
  Labelling labelling(ground_, part_, neighbours_, settings_.prices);
  if (auto done = labelling.start(found_); !done) return done;
  if (auto joined = labelling.offer(proposals_); !joined) return tl::unexpected(joined.error());
  if (auto done = search_further(labelling); !done) return done;
  if (auto done = labelling.drop(); !done) return done;
  found_ = labelling.models();
  std::vector<Model> kept;
  for (const std::size_t m : labelling.kept()) {
    kept.emplace_back();
    if (m != Labelling::kJoined) kept.back() = std::move(result.models[m]);
    kept.back().type = space_.type();
  }
  result.models = std::move(kept);
  for (std::size_t m = 0; m < found_.size(); ++m) result.models[m].parameters = space_.to_data(found_[m], points_.frame());
  labels_.resize(points_.size());
  labelling.write(labels_);
  count_effort(result);
  return {};
}

Expected<> MultiModel::polish() {
  // A model found late saw only what earlier ones had left; where two cross, the points there are both theirs.
  restore_caps();
  for (models::Position& theta : found_) {
    if (auto done = refine_one(ground_, settings_.loss, caps_, theta, full_rounds()); !done) return tl::unexpected(done.error());
  }
  if (part_searched_ || settings_.loss != Loss::truncated_l1 || shares_out()) return {};
  // Few points leave the least absolute deviations well apart from what rounded corners make of them.
  Ground sharp = ground_;
  for (const float corner : kSharper) {
    sharp.corner = corner;
    for (models::Position& theta : found_) {
      if (auto done = refine_one(sharp, settings_.loss, caps_, theta, kMostRounds); !done) return tl::unexpected(done.error());
    }
  }
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
