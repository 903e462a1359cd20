// The public face of the fit: options are checked and the back end is kept here; fit_call.cpp does the work.
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/fit.hpp>

#include "host/common/thrown.hpp"
#include "host/models/own_model.hpp"
#include "host/swarm/fit_call.hpp"
#include "host/swarm/fitter_parts.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit {
namespace {

std::shared_ptr<std::vector<swarm::Kind>> kinds_of(const FitOptions& options) {
  return std::make_shared<std::vector<swarm::Kind>>(swarm::make_kinds(options));
}

}  // namespace

struct Fitter::State {
  FitOptions options;
  std::shared_ptr<std::vector<swarm::Kind>> kinds;  // that they ask for; a fit under way keeps those it began with
  std::shared_ptr<models::OwnWatch> watch = std::make_shared<models::OwnWatch>();
  std::unique_ptr<kernels::FitnessEvaluator> evaluator;
  std::string reason;
  SwarmObserver observer;

  swarm::EvaluatorPair pair;

  /// Takes the options, and makes the back end that they ask for.
  Expected<> open(FitOptions wanted) {
    kernels::EvaluatorOptions evaluation;
    evaluation.threads = wanted.threads;
    evaluation.pipeline_cache = wanted.pipeline_cache;
    if (wanted.own) {
      wanted.own = models::watched(*wanted.own, watch);
      evaluation.own = models::to_kernel(*wanted.own);
    }
    auto made = kernels::make_evaluator(wanted.backend, evaluation);
    if (!made) {
      Error error = swarm::to_error(made.error());
      // There are no data yet: what is invalid here is an option.
      if (made.error().kind == kernels::Failure::Kind::invalid) error.kind = Error::Kind::invalid_option;
      return tl::unexpected(std::move(error));
    }
    auto asked = kinds_of(wanted);  // nothing fails from here on
    evaluator = std::move(made->evaluator);
    reason = std::move(made->reason);
    kinds = std::move(asked);
    options = std::move(wanted);
    return {};
  }
};

Fitter::Fitter(std::unique_ptr<State> state) : state_(std::move(state)) {}
Fitter::~Fitter() = default;
Fitter::Fitter(Fitter&&) noexcept = default;
Fitter& Fitter::operator=(Fitter&&) noexcept = default;

Expected<Fitter> Fitter::create(const FitOptions& options) try {
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  auto state = std::make_unique<State>();
  if (auto opened = state->open(options); !opened) return tl::unexpected(opened.error());
  return Fitter(std::move(state));
} catch (...) {
  return common::error_of_thrown(Error::Kind::backend_unavailable, [] { return std::string("no memory for a back end"); });
}

Fitter FitterParts::assemble(const FitOptions& options, std::unique_ptr<kernels::FitnessEvaluator> evaluator, std::string reason) {
  auto state = std::make_unique<Fitter::State>();
  state->options = options;
  state->kinds = kinds_of(options);
  state->evaluator = std::move(evaluator);
  state->reason = std::move(reason);
  return Fitter(std::move(state));
}

void Fitter::observe(SwarmObserver observer) { state_->observer = std::move(observer); }

const FitOptions& Fitter::options() const noexcept { return state_->options; }

Expected<> Fitter::set_options(const FitOptions& options) try {
  if (auto ok = options.validate(); !ok) return ok;
  const FitOptions& old = state_->options;
  if (options.backend != old.backend)
    return fail(Error::Kind::invalid_option, fmt::format("backend is {}, must stay {}", options.backend, old.backend));
  if (options.threads != old.threads)
    return fail(Error::Kind::invalid_option, fmt::format("threads is {}, must stay {}", options.threads, old.threads));
  if (options.pipeline_cache != old.pipeline_cache)
    return fail(Error::Kind::invalid_option, fmt::format("pipeline_cache is {}, must stay {}", options.pipeline_cache, old.pipeline_cache));
  if (options.own || old.own) return state_->open(options);
  FitOptions wanted = options;
  state_->kinds = kinds_of(options);
  state_->options = std::move(wanted);
  return {};
} catch (...) {
  return common::error_of_thrown(Error::Kind::backend_unavailable, [] { return std::string("no memory for a back end"); });
}

BackendInfo Fitter::backend() const {
  const kernels::Identity& who = state_->evaluator->identity();
  return {who.backend, who.device, state_->reason};
}

void Fitter::prepare() noexcept try {
  static_cast<void>(swarm::FitCall::rehearse(state_->options, *state_->evaluator, state_->pair));
} catch (...) {
  // What is wrong will be wrong in fit() as well, which says so.
}

Expected<FitResult> Fitter::fit(const PointsView& points, const ModelCallback& on_model, std::stop_token stop,
                                const std::vector<Model>& warm_start) try {
  swarm::Limits limits;
  limits.budget_ms = state_->options.time_budget_ms;
  limits.stop = std::move(stop);
  limits.max_models = state_->options.max_models;
  state_->watch->take();
  const ModelCallback told = common::going_by(on_model);
  const SwarmObserver observer = common::going_by(state_->observer);
  swarm::FitCall call(state_->options, state_->kinds, *state_->evaluator, state_->pair, observer, told, std::move(limits));
  auto result = call.run(points, warm_start);
  if (!result) return result;
  if (auto thrown = state_->watch->take()) return tl::unexpected(std::move(*thrown));
  result->backend = backend();
  return result;
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [&] { return fmt::format("no memory for {} points", points.size()); });
}

std::string FitResult::brief() const {
  std::size_t explained = 0;
  for (const Model& model : models) explained += model.inliers;
  return fmt::format("{} models explain {} of {} points at threshold {:.4g} in {:.1f} ms on {} ({}); {}", models.size(), explained,
                     finite_points, threshold, total_ms, backend.name, backend.device, stop_reason);
}

std::vector<Device> devices() {
  std::vector<Device> all;
  for (kernels::DeviceDescription& d : kernels::list_devices()) {
    all.push_back({std::move(d.backend), std::move(d.device), std::move(d.kind), d.usable, std::move(d.reason), std::move(d.limits)});
  }
  return all;
}

Expected<FitResult> fit(const PointsView& points, const FitOptions& options, const ModelCallback& on_model) {
  auto fitter = Fitter::create(options);
  if (!fitter) return tl::unexpected(fitter.error());
  return fitter->fit(points, on_model);
}

}  // namespace swarmfit
