#include "host/swarm/pilot.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "host/swarm/payment.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

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

Pilot::Pilot(const Problem& problem, const Unexplained& left, Limits limits) : problem_(problem), left_(left), limits_(std::move(limits)) {
  for (const Kind& kind : problem.kinds) landscapes_.emplace_back(problem.evaluator, *kind.space, problem.points.frame(), kind.settings);
}

double Pilot::elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - limits_.start).count(); }

std::optional<std::string_view> Pilot::interrupted() const {
  if (limits_.stop.stop_requested()) return "cancelled";
  if (limits_.budget_ms > 0 && elapsed_ms() >= limits_.budget_ms) return "time budget used up";
  return std::nullopt;
}

double Pilot::loss_of_nothing(std::span<const float> caps) const {
  if (problem_.settings.deflation == Deflation::parametric && problem_.allowed.empty()) {
    return problem_.settings.threshold *
           static_cast<double>(problem_.part_searched ? problem_.part.index().size() : problem_.points.finite_count());
  }
  double sum = 0;
  if (problem_.settings.deflation == Deflation::parametric) {
    for (std::size_t k = 0; k < problem_.searched().size(); ++k) {
      sum += problem_.points.finite(problem_.searched().index(k)) ? static_cast<double>(problem_.searched().allowed_at(k)) : 0.0;
    }
    return sum;
  }
  return sum_of(problem_.part_searched ? std::span<const float>(left_.part_caps()) : caps);
}

Background Pilot::background(std::size_t kind, std::span<const float> caps) const {
  if (problem_.space(kind).type() != ModelType::circle2d || problem_.part_searched) return {};
  Background evenly{0, problem_.box.low, problem_.box.high};
  double square = 0;
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (problem_.points.finite(i)) square += static_cast<double>(caps[i]) * static_cast<double>(caps[i]);
  }
  // A point d from the curve saves c - d: the square of its cap in all, on both sides, over the area.
  const double area = problem_.box.area() * problem_.points.frame().scale;
  if (area > 0) evenly.per_length = square / area;
  return evenly;
}

Expected<bool> Pilot::fly(Swarm& swarm, std::size_t kind, std::uint32_t round, std::span<const models::Position> seeds,
                          std::span<const float> caps, float alive) {
  // Normals bring neighbourhoods that are too close for a kind which has no use for them.
  const bool close = problem_.points.dimension() > 3 || problem_.space(kind).needs_normals();
  Sampler sampler(problem_.points, problem_.part.index(), close ? problem_.neighbours : none_, problem_.space(kind), problem_.random);
  kernels::Reused<float> left, room;
  const bool shown = problem_.settings.deflation == Deflation::residual;  // else the caps only tell what a model still explains
  if (!shown) problem_.part.gather(caps, left);
  sampler.prefer_unexplained(problem_.levelled(shown ? left_.part_caps() : left, room, problem_.part_allowed), alive);
  scale_ = loss_of_nothing(caps);
  swarm.share_work(problem_.evaluator);
  if (problem_.settings.deflation == Deflation::residual) landscapes_[kind].expect(background(kind, caps));
  if (!swarm.start(sampler, round, seeds)) {
    why_ended_ = "complete: what is left determines no model";
    return false;
  }
  while (!swarm.converged() && swarm.steps() < problem_.settings.iterations) {
    if (auto reason = interrupted()) {
      why_ended_ = *reason;
      return false;
    }
    auto done = watch_ != nullptr ? watched_step(swarm, kind, sampler) : swarm.step(landscapes_[kind], sampler, scale_);
    if (!done) return tl::unexpected(done.error());
  }
  if (watch_ != nullptr) ++watch_->swarms;
  steps_ += static_cast<std::size_t>(swarm.steps());
  return true;
}

Expected<> Pilot::watched_step(Swarm& swarm, std::size_t kind, const Sampler& sampler) {
  SwarmStep step;
  step.type = problem_.space(kind).type();
  step.swarm = watch_->swarms;
  step.step = static_cast<std::size_t>(swarm.steps());
  if (auto done = swarm.step(landscapes_[kind], sampler, scale_); !done) return done;
  const auto positions = swarm.positions();
  step.positions.resize(problem_.space(kind).parameter_count(), static_cast<Eigen::Index>(positions.size()));
  for (std::size_t j = 0; j < positions.size(); ++j)
    step.positions.col(static_cast<Eigen::Index>(j)) = problem_.space(kind).to_data(positions[j], problem_.points.frame());
  step.fitness.assign(swarm.fitness().begin(), swarm.fitness().end());
  step.best = problem_.space(kind).to_data(swarm.best(), problem_.points.frame());
  step.best_fitness = swarm.best_fitness();
  step.nothing_explained = scale_;
  watch_->observer(step);
  return {};
}

}  // namespace swarmfit::swarm
