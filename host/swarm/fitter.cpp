// The public face of the fit: options and points are checked here, the work is done in multi_model.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include <swarmfit/fit.hpp>

#include "host/common/thrown.hpp"
#include "host/models/model_space.hpp"
#include "host/models/own_model.hpp"
#include "host/swarm/along.hpp"
#include "host/swarm/fitter_parts.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/noise_scale.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/settle.hpp"
#include "host/swarm/two_searches.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit {
namespace {

constexpr double kSurface = 0.01;     // [m]
constexpr double kHomography = 6.0;   // [px]
constexpr double kFundamental = 2.5;  // [px]

/// The kind's fixed default, or none where the threshold is estimated.
std::optional<double> default_threshold(const FitOptions& options) {
  // How far off the near points are depends on the sensor.
  if (options.noise != Noise::none) return std::nullopt;
  switch (options.model) {
    case ModelType::line2d:
    case ModelType::circle2d:
    case ModelType::own: return std::nullopt;
    case ModelType::plane:
    case ModelType::sphere:
    case ModelType::cylinder: return kSurface;
    case ModelType::homography: return kHomography;
    case ModelType::fundamental: return kFundamental;
  }
  return std::nullopt;
}

Expected<> check_points(const PointsView& points, const models::WorkingPoints& working, const models::ModelSpace& space) {
  const auto least = static_cast<std::size_t>(space.minimal_sample());
  if (points.size() < least) {
    return fail(Error::Kind::bad_input, fmt::format("points is {}, must be >= {} to fit a {}", points.size(), least, space.title()));
  }
  if (working.finite_count() < least) {
    return fail(Error::Kind::bad_input, fmt::format("finite points is {} of {}, must be >= {} to fit a {}", working.finite_count(),
                                                    points.size(), least, space.title()));
  }
  if (working.rank() < space.least_rank()) {
    static constexpr const char* kShapes[] = {"all coincide", "are collinear", "are coplanar"};
    return fail(Error::Kind::bad_input,
                fmt::format("the {} finite points {}: rank is {}, must be >= {} to fit a {}", working.finite_count(),
                            kShapes[working.rank()], working.rank(), space.least_rank(), space.title()));
  }
  return {};
}

/// Enough if one of the kinds can be fitted; else what the first lacks.
Expected<> check_points(const PointsView& points, const models::WorkingPoints& working, std::span<const swarm::Kind> kinds) {
  if (const auto stray = working.stray()) return fail(Error::Kind::bad_input, models::text_of(*stray));
  const auto first = check_points(points, working, *kinds.front().space);
  const bool any = std::any_of(kinds.begin(), kinds.end(), [&](const swarm::Kind& kind) {
    return !kind.hidden && check_points(points, working, *kind.space).has_value();
  });
  return any ? Expected<>() : first;
}

/// Whose samples ask most of a cloud.
const models::ModelSpace& keenest(std::span<const swarm::Kind> kinds) {
  const auto keen = std::find_if(kinds.begin(), kinds.end(), [](const swarm::Kind& kind) { return kind.space->agrees_by_normals(); });
  return *(keen == kinds.end() ? kinds.front() : *keen).space;
}

Expected<> check_backend(const kernels::FitnessEvaluator& evaluator, std::span<const swarm::Kind> kinds, std::size_t points) {
  for (const swarm::Kind& kind : kinds) {
    const kernels::Workload workload{kind.space->kind(), points, static_cast<std::size_t>(kind.settings.particles)};
    if (const auto support = evaluator.supports(workload); !support) return fail(Error::Kind::backend_unavailable, support.reason);
  }
  return {};
}

/// The same models in another cloud's frame.
std::vector<models::Placed> moved(std::vector<models::Placed> models, const models::Frame& from, const models::Frame& to) {
  for (auto& [space, theta] : models) theta = space->from_data(space->to_data(theta, from), to);
  return models;
}

Expected<models::WorkingPoints> survey(kernels::FitnessEvaluator& evaluator, const PointsView& points) {
  kernels::Survey looked_at;
  if (auto done = evaluator.survey(models::to_kernel(points), looked_at); !done) return tl::unexpected(swarm::to_error(done.error()));
  return models::WorkingPoints(points, std::move(looked_at));
}

}  // namespace

struct Fitter::State {
  FitOptions options;
  std::shared_ptr<models::OwnWatch> watch = std::make_shared<models::OwnWatch>();
  std::unique_ptr<kernels::FitnessEvaluator> evaluator;
  std::string reason;
  SwarmObserver observer;

  /// One thread each, for two searches side by side.
  using Pair = std::array<std::unique_ptr<kernels::FitnessEvaluator>, 2>;
  Pair beside;

  /// Null where two searches are not asked for or must go one after the other: on a device there is but one of, or under an observer's
  /// eyes.
  Expected<const Pair*> evaluators_beside(bool asked) {
    if (!asked || observer || evaluator->identity().backend != "cpu") return nullptr;
    for (auto& one : beside) {
      if (one != nullptr) continue;
      kernels::EvaluatorOptions alone;
      alone.threads = 1;
      auto made = kernels::make_cpu_evaluator(alone);
      if (!made) return tl::unexpected(swarm::to_error(made.error()));
      one = std::move(*made);
    }
    return &beside;
  }

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
    evaluator = std::move(made->evaluator);
    reason = std::move(made->reason);
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
  state_->options = std::move(wanted);
  return {};
} catch (...) {
  return common::error_of_thrown(Error::Kind::backend_unavailable, [] { return std::string("no memory for a back end"); });
}

BackendInfo Fitter::backend() const {
  const kernels::Identity& who = state_->evaluator->identity();
  return {who.backend, who.device, state_->reason};
}

Expected<FitResult> Fitter::fit(const PointsView& points, const ModelCallback& on_model, std::stop_token stop,
                                const std::vector<Model>& warm_start) try {
  swarm::Limits limits;
  limits.budget_ms = state_->options.time_budget_ms;
  limits.stop = std::move(stop);
  limits.max_models = state_->options.max_models;
  const FitOptions& options = state_->options;
  state_->watch->take();
  std::vector<swarm::Kind> kinds = swarm::make_kinds(options);
  const int columns = options.own ? options.own->dimension : dimension(options.model);
  if (points.dimension() != columns) {
    return fail(Error::Kind::bad_input,
                fmt::format("points have {} columns, must have {} to fit a {}", points.dimension(), columns, kinds.front().space->title()));
  }
  kernels::FitnessEvaluator& evaluator = *state_->evaluator;
  auto whole = survey(evaluator, points);
  if (!whole) return tl::unexpected(whole.error());
  if (auto ok = check_points(points, *whole, kinds); !ok) return tl::unexpected(ok.error());
  swarm::resolve(kinds, options, whole->finite_count(), 1.0);
  const swarm::Settings& settings = kinds.front().settings;

  const swarm::Random random(options.seed);
  std::optional<swarm::Rows> thin_rows;
  models::WorkingPoints thin;
  if (settings.stands_for > 1) {
    const std::vector<std::uint32_t> thinned = swarm::draw_part(*whole, random, swarm::kThinnedPart, settings.fit_points, &evaluator);
    thin_rows.emplace(whole->view(), thinned, &evaluator);
    auto looked_at = survey(evaluator, thin_rows->view());
    if (!looked_at) return tl::unexpected(looked_at.error());
    thin = std::move(*looked_at);
  }
  models::WorkingPoints& working = thin_rows ? thin : *whole;
  const bool searches_part = settings.searches_part(working.finite_count());
  const double depth = options.noise == Noise::none ? 0.0 : swarm::near_depth(working);
  const std::vector<float> spread = swarm::spread_of(options.noise, working, depth);
  const swarm::Part part =
      swarm::look_closely(working, keenest(kinds), random, searches_part ? settings.search_points : swarm::kSampledFrom, &evaluator,
                          searches_part ? std::span<const float>(spread) : std::span<const float>());
  const std::size_t searched = searches_part ? part.points.index().size() : working.size();
  if (auto ok = check_backend(evaluator, kinds, searched); !ok) return tl::unexpected(ok.error());

  FitResult result;
  const ModelCallback told = common::going_by(on_model);
  swarm::Watch watch{common::going_by(state_->observer), 0};
  std::vector<swarm::Known> known;
  bool points_set = false;
  const std::optional<double> given = options.threshold ? options.threshold : default_threshold(options);
  if (options.estimate_threshold || !given) {
    auto estimated =
        swarm::estimate_threshold(evaluator, working, part, whole->finite_count(), options, state_->observer ? &watch : nullptr, spread);
    if (!estimated) return tl::unexpected(estimated.error());
    result.threshold = estimated->threshold;
    points_set = true;
    // The preset of the paper finds each model by a search of its own.
    if (options.preset == Preset::fast) known = std::move(estimated->models);
  } else {
    result.threshold = *given;
  }
  swarm::resolve(kinds, options, whole->finite_count(), result.threshold);
  const bool twice = kinds.front().settings.searches > 1 && !searches_part;
  auto beside = state_->evaluators_beside(twice);
  if (!beside) return tl::unexpected(beside.error());
  const bool own_points = *beside != nullptr;
  std::optional<swarm::MultiModel> search(std::in_place, own_points ? *(**beside)[0] : evaluator, kinds, working, part, options.seed,
                                          limits, spread);
  search->watched_by(state_->observer ? &watch : nullptr);
  if (points_set && !own_points) search->points_are_set();
  if (twice) {
    std::stop_source stop_again;
    const std::stop_callback pass_on(limits.stop, [&] { stop_again.request_stop(); });
    swarm::Limits limits_again = limits;
    limits_again.stop = stop_again.get_token();
    swarm::MultiModel again(own_points ? *(**beside)[1] : evaluator, kinds, working, part, options.seed, limits_again, spread);
    again.watched_by(state_->observer ? &watch : nullptr);
    const bool at_once = options.threads != 1 && std::thread::hardware_concurrency() > 1;
    const auto how = !own_points ? swarm::Together::on_one_evaluator : at_once ? swarm::Together::at_once : swarm::Together::in_turn;
    auto done = swarm::search_twice(*search, again, stop_again, how, told, warm_start, result, known);
    if (!done) return tl::unexpected(done.error());
  } else if (auto done = search->run(told, warm_start, result, known); !done) {
    return tl::unexpected(done.error());
  }
  std::vector<models::Placed> found = search->found(), hidden = search->hidden();
  const auto tau = static_cast<float>(result.threshold);
  const std::vector<float> allowed = swarm::allowed_by(thin_rows ? swarm::spread_of(options.noise, *whole, depth) : spread, tau);
  const swarm::Ground ground{.evaluator = evaluator, .space = *kinds.front().space, .points = *whole, .tau = tau, .allowed = allowed};
  if (thin_rows) {
    found = moved(std::move(found), working.frame(), whole->frame());
    hidden = moved(std::move(hidden), working.frame(), whole->frame());
    if (auto done = swarm::refit(ground, found, search->problem().shares_points(!search->hidden().empty()), hidden); !done) return tl::unexpected(done.error());
  }
  if (settings.refine && options.preset == Preset::fast) {
    if (auto done = swarm::refine_along(ground, found, hidden); !done) return tl::unexpected(done.error());
  }
  result.labels = thin_rows ? std::vector<std::uint16_t>{} : search->labels();
  std::vector<float> corners;
  for (const models::Placed& model : search->found()) corners.push_back(search->problem().corner(*model.space));
  if (!search->problem().hidden_owns()) hidden.clear();
  search.reset();  // of many points it holds much
  if (auto done = swarm::settle(ground, found, hidden, corners, result); !done) return tl::unexpected(done.error());
  if (auto thrown = state_->watch->take()) return tl::unexpected(std::move(*thrown));
  result.backend = backend();
  result.seed = options.seed;
  result.finite_points = whole->finite_count();
  result.total_ms = std::chrono::duration<double, std::milli>(swarm::Clock::now() - limits.start).count();
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
