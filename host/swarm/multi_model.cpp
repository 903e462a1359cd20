#include "host/swarm/multi_model.hpp"

#include <algorithm>
#include <cmath>

#include "host/swarm/deflation.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;            // spread of the list of global bests, as a share of the scale, below which it is stable
constexpr int kRounds = 8;                  // of refinement
constexpr int kFullRounds = 2;              // of it on all points, where it was done on a part of them before
constexpr std::size_t kSampledFrom = 8192;  // points that minimal samples are drawn from: enough to tell surfaces apart

}  // namespace

MultiModel::MultiModel(kernels::FitnessEvaluator& evaluator, kernels::FitnessEvaluator* scout, const models::ModelSpace& space,
                       const models::WorkingPoints& points, const Settings& settings, std::uint64_t seed, Limits limits)
    : evaluator_(evaluator),
      scout_(scout),
      space_(space),
      points_(points),
      settings_(settings),
      random_(seed),
      limits_(std::move(limits)),
      landscape_(evaluator, space, points.frame(), settings),
      searched_(scout != nullptr ? *scout : evaluator, space, points.frame(), settings),
      subset_(points, random_, scout != nullptr ? settings.search_points : kSampledFrom) {
  tau_.assign(points.size(), static_cast<float>(settings.threshold));
  caps_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) caps_[i] = points.finite(i) ? tau_[i] : 0.0F;
  distances_.resize(points.size());
}

int MultiModel::rounds() const noexcept { return scout_ != nullptr ? kFullRounds : kRounds; }

double MultiModel::elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - limits_.start).count(); }

std::optional<std::string> MultiModel::interrupted() const {
  if (limits_.stop.stop_requested()) return "cancelled";
  if (limits_.budget_ms > 0 && elapsed_ms() >= limits_.budget_ms) return "time budget used up";
  return std::nullopt;
}

Expected<> MultiModel::distances(const models::Position& theta) {
  const Eigen::VectorXd data = space_.to_data(theta, points_.frame());
  const kernels::ModelView model{space_.kind(), std::span<const double>(data.data(), static_cast<std::size_t>(data.size()))};
  if (auto done = evaluator_.distances(model, distances_); !done) return tl::unexpected(to_error(done.error()));
  return {};
}

Expected<> MultiModel::set_caps(std::span<const float> caps) {
  if (auto done = evaluator_.set_caps(caps); !done) return tl::unexpected(to_error(done.error()));
  if (scout_ == nullptr) return {};
  std::vector<float> part;
  subset_.gather(caps, part);
  if (auto done = scout_->set_caps(part); !done) return tl::unexpected(to_error(done.error()));
  return {};
}

void MultiModel::count_effort(FitResult& result) const {
  kernels::Effort effort = evaluator_.effort();
  if (scout_ != nullptr) {
    effort.evaluations += scout_->effort().evaluations;
    effort.touched += scout_->effort().touched;
  }
  result.evaluations = static_cast<std::size_t>(effort.evaluations);
  const double whole = static_cast<double>(effort.evaluations) * static_cast<double>(points_.finite_count());
  result.points_touched = whole > 0 ? static_cast<double>(effort.touched) / whole : 1.0;
}

Expected<> MultiModel::run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result) {
  if (scout_ != nullptr) {
    if (auto done = scout_->set_points(subset_.view()); !done) return tl::unexpected(to_error(done.error()));
  }
  if (auto done = set_caps(caps_); !done) return done;
  std::vector<models::Position> seeds;
  for (const Model& model : warm_start) {
    models::Position theta = space_.from_data(model.parameters, points_.frame());
    if (space_.admit(theta)) seeds.push_back(std::move(theta));
  }
  int unpaid = 0;
  for (std::uint32_t round = 0; stop_reason_.empty(); ++round) {
    if (limits_.max_models > 0 && found_.size() >= limits_.max_models) {
      stop_reason_ = "max-models reached";
      break;
    }
    models::Position theta;
    double loss = 0;
    auto outcome = search(round, seeds, theta, loss);
    if (!outcome) return tl::unexpected(outcome.error());
    if (*outcome == Outcome::interrupted) break;
    if (*outcome == Outcome::found) {
      unpaid = 0;
      auto go_on = accept(theta, loss, on_model, result);
      if (!go_on) return tl::unexpected(go_on.error());
      if (!*go_on) stop_reason_ = "stopped by the caller";
      continue;
    }
    if (settings_.deflation == Deflation::parametric) searched_.deflate_around(theta);
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
  const std::span<const std::uint32_t> index = subset_.index();
  const bool all = scout_ == nullptr;
  if (settings_.deflation == Deflation::parametric) {
    return settings_.threshold * static_cast<double>(all ? points_.finite_count() : index.size());
  }
  double sum = 0;
  if (all) {
    for (const float cap : caps_) sum += static_cast<double>(cap);
  } else {
    for (const std::uint32_t i : index) sum += static_cast<double>(caps_[i]);
  }
  return sum;
}

Expected<MultiModel::Outcome> MultiModel::search(std::uint32_t round, std::span<const models::Position> seeds, models::Position& theta,
                                                 double& loss) {
  Sampler sampler(points_, subset_.index(), space_, random_);
  sampler.prefer_unexplained(caps_, static_cast<float>(settings_.threshold));
  scale_ = loss_of_nothing();
  Swarm swarm(space_, settings_, random_);
  steps_ = 0;
  if (!swarm.start(sampler, round, seeds)) {
    stop_reason_ = "complete: what is left determines no model";
    return Outcome::interrupted;
  }
  while (!swarm.converged() && swarm.steps() < settings_.iterations) {
    if (auto reason = interrupted()) {
      stop_reason_ = *reason;
      return Outcome::interrupted;
    }
    if (auto done = swarm.step(searched_, sampler, scale_); !done) return tl::unexpected(done.error());
  }
  steps_ = static_cast<std::size_t>(swarm.steps());
  theta = swarm.best();
  if (settings_.refine && scout_ != nullptr) {
    std::vector<float> tau, caps;
    subset_.gather(tau_, tau);
    subset_.gather(caps_, caps);
    double part = swarm.best_fitness();
    const Ground ground{*scout_, space_, points_, tau, subset_.index()};
    if (auto done = refine_one(ground, searched_, caps, theta, part); !done) return tl::unexpected(done.error());
  }
  auto exact = landscape_.loss(theta);
  if (!exact) return tl::unexpected(exact.error());
  loss = *exact;
  if (settings_.refine) {
    const Ground ground{evaluator_, space_, points_, tau_, {}};
    if (auto done = refine_one(ground, landscape_, caps_, theta, loss, rounds()); !done) return tl::unexpected(done.error());
  }
  if (auto done = distances(theta); !done) return tl::unexpected(done.error());
  if (pays(count_support(distances_, caps_, tau_), settings_, space_.minimal_sample())) return Outcome::found;
  const auto& list = swarm.global_bests();
  const bool stable = list.front().fitness - list.back().fitness < kStable * scale_;
  return settings_.deflation == Deflation::parametric && stable ? Outcome::complete : Outcome::unpaid;
}

Expected<bool> MultiModel::accept(const models::Position& theta, double loss, const ModelCallback& on_model, FitResult& result) {
  const std::size_t evaluations_before = result.evaluations;
  count_effort(result);
  Model model;
  model.type = space_.type();
  model.parameters = space_.to_data(theta, points_.frame());
  model.cost = loss;
  model.iterations = steps_;
  model.evaluations = result.evaluations - evaluations_before;
  model.points_touched = result.points_touched;
  model.found_at_ms = elapsed_ms();
  double square = 0;
  for (std::size_t i = 0; i < distances_.size(); ++i) {
    if (distances_[i] <= tau_[i] && caps_[i] >= 0.5F * tau_[i]) {
      ++model.inliers;
      square += static_cast<double>(distances_[i]) * distances_[i];
    }
  }
  model.rms = model.inliers > 0 ? std::sqrt(square / static_cast<double>(model.inliers)) : 0.0;
  found_.push_back(theta);
  result.models.push_back(model);
  result.iterations += steps_;
  if (settings_.deflation == Deflation::parametric) searched_.deflate_around(theta);
  if (auto done = deflate(distances_); !done) return tl::unexpected(done.error());
  return !on_model || on_model(result.models.back()) == Verdict::go_on;
}

Expected<> MultiModel::deflate(std::span<const float> distances) {
  swarm::deflate(distances, tau_, tail_reach(distances, caps_, tau_), settings_.dead_zone_slope, caps_);
  if (settings_.deflation == Deflation::parametric) return {};  // there the caps only tell what a model still explains
  return set_caps(caps_);
}

Expected<> MultiModel::finish(FitResult& result) {
  if (settings_.joint && !found_.empty() && !limits_.stop.stop_requested()) {
    const Ground ground{evaluator_, space_, points_, tau_, {}};
    if (auto done = polish(ground); !done) return done;
    // With hundreds of thousands of points the polished models are where the joint refit would leave them.
    if (scout_ == nullptr) {
      if (auto energy = refine_jointly(ground, found_, kRounds); !energy) return tl::unexpected(energy.error());
    }
    if (auto done = drop_unpaid(ground, result); !done) return done;
    for (std::size_t m = 0; m < found_.size(); ++m) result.models[m].parameters = space_.to_data(found_[m], points_.frame());
  }
  if (auto done = label(result); !done) return done;
  count_effort(result);
  return describe(result);
}

Expected<> MultiModel::polish(const Ground& ground) {
  // A model found late saw only what earlier ones had left; where two cross, the points there are both theirs.
  std::vector<float> full = tau_;
  for (std::size_t i = 0; i < full.size(); ++i) full[i] = points_.finite(i) ? tau_[i] : 0.0F;
  if (auto done = evaluator_.set_caps(full); !done) return tl::unexpected(to_error(done.error()));
  for (models::Position& theta : found_) {
    auto loss = landscape_.loss(theta);
    if (!loss) return tl::unexpected(loss.error());
    if (auto done = refine_one(ground, landscape_, full, theta, *loss, rounds()); !done) return done;
  }
  return {};
}

Expected<> MultiModel::drop_unpaid(const Ground& ground, FitResult& result) {
  while (found_.size() > 1) {
    auto unique = unique_support(ground, found_);
    if (!unique) return tl::unexpected(unique.error());
    const auto least = std::min_element(unique->begin(), unique->end());
    if (2 * *least >= settings_.min_inliers) return {};
    found_.erase(found_.begin() + (least - unique->begin()));
    result.models.erase(result.models.begin() + (least - unique->begin()));
    if (auto energy = refine_jointly(ground, found_, rounds()); !energy) return tl::unexpected(energy.error());
  }
  return {};
}

Expected<> MultiModel::label(FitResult& result) {
  std::vector<Eigen::VectorXd> parameters;
  parameters.reserve(found_.size());
  std::vector<kernels::ModelView> views;
  for (const models::Position& theta : found_) {
    parameters.push_back(space_.to_data(theta, points_.frame()));
    views.push_back({space_.kind(), std::span<const double>(parameters.back().data(), static_cast<std::size_t>(parameters.back().size()))});
  }
  result.labels.assign(points_.size(), 0);
  const auto tau = static_cast<float>(settings_.threshold);
  if (auto done = evaluator_.assign(views, std::span<const float>(&tau, 1), result.labels); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  return {};
}

Expected<> MultiModel::describe(FitResult& result) {
  const models::Frame& frame = points_.frame();
  std::vector<std::vector<std::uint32_t>> own(found_.size());
  for (std::size_t i = 0; i < result.labels.size(); ++i) {
    if (result.labels[i] > 0) own[result.labels[i] - 1U].push_back(static_cast<std::uint32_t>(i));
  }
  for (std::size_t m = 0; m < found_.size(); ++m) {
    if (auto done = distances(found_[m]); !done) return done;
    Model& model = result.models[m];
    double square = 0;
    for (const std::uint32_t i : own[m]) square += static_cast<double>(distances_[i]) * distances_[i];
    const auto n = static_cast<double>(own[m].size());
    model.inliers = own[m].size();
    model.rms = n > 0 ? std::sqrt(square / n) : 0.0;
    const double variance = square / std::max(1.0, n - space_.freedom()) / (frame.scale * frame.scale);
    const std::vector<double> weight(own[m].size(), 1.0);
    model.covariance = space_.covariance_to_data(variance * space_.unit_covariance(points_, {own[m], weight}, found_[m]), found_[m], frame);
  }
  return {};
}

}  // namespace swarmfit::swarm
