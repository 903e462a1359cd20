#include "host/swarm/fit_call.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "host/models/model_space.hpp"
#include "host/models/synthetic.hpp"
#include "host/swarm/along.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/noise_scale.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/settle.hpp"
#include "host/swarm/two_searches.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
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

/// Given, or the kind's default; none where it is to be estimated.
std::optional<double> fixed_threshold(const FitOptions& options) {
  if (options.estimate_threshold) return std::nullopt;
  return options.threshold ? options.threshold : default_threshold(options);
}

/// The same work on made-up points, in their unit, and as little of it as goes all the way.
FitOptions rehearsal_of(const FitOptions& options) {
  constexpr double kWellAbove = 5 * models::kSyntheticSpread;
  constexpr int kFewSteps = 5, kFewParticles = 64;
  FitOptions small = options;
  small.estimate_threshold = !fixed_threshold(options);
  small.threshold = small.estimate_threshold ? std::nullopt : std::optional(kWellAbove);
  small.noise = Noise::none;  // they have no depth
  small.rivals.clear();       // a contest of all kinds takes longer than what it would save
  small.prior.reset();
  small.min_inliers = 0;
  small.iterations = std::min(options.iterations.value_or(kFewSteps), kFewSteps);
  if (options.particles) small.particles = std::min(*options.particles, kFewParticles);
  return small;
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
Expected<> check_points(const PointsView& points, const models::WorkingPoints& working, std::span<const Kind> kinds) {
  if (const auto stray = working.stray()) return fail(Error::Kind::bad_input, models::text_of(*stray));
  const auto first = check_points(points, working, *kinds.front().space);
  const bool any = std::any_of(kinds.begin(), kinds.end(),
                               [&](const Kind& kind) { return !kind.hidden && check_points(points, working, *kind.space).has_value(); });
  return any ? Expected<>() : first;
}

/// Whose samples ask most of a cloud.
const models::ModelSpace& keenest(std::span<const Kind> kinds) {
  const auto keen = std::find_if(kinds.begin(), kinds.end(), [](const Kind& kind) { return kind.space->agrees_by_normals(); });
  return *(keen == kinds.end() ? kinds.front() : *keen).space;
}

Expected<> check_backend(const kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, std::size_t points) {
  for (const Kind& kind : kinds) {
    const kernels::Workload workload{kind.space->kind(), points, static_cast<std::size_t>(kind.settings.starters)};
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
  if (auto done = evaluator.survey(models::to_kernel(points), looked_at); !done) return tl::unexpected(to_error(done.error()));
  return models::WorkingPoints(points, std::move(looked_at));
}

}  // namespace

Expected<> EvaluatorPair::make() {
  for (auto& one : pair_) {
    if (one != nullptr) continue;
    kernels::EvaluatorOptions alone;
    alone.threads = 1;
    auto made = kernels::make_cpu_evaluator(alone);
    if (!made) return tl::unexpected(to_error(made.error()));
    one = std::move(*made);
  }
  return {};
}

FitCall::FitCall(const FitOptions& options, std::shared_ptr<std::vector<Kind>> kinds, kernels::FitnessEvaluator& evaluator,
                 EvaluatorPair& pair, const SwarmObserver& observer, const ModelCallback& on_model, Limits limits)
    : options_(options),
      evaluator_(evaluator),
      pair_(pair),
      on_model_(on_model),
      watch_{observer, 0},
      limits_(std::move(limits)),
      kept_kinds_(std::move(kinds)),
      kinds_(*kept_kinds_) {}

Expected<std::size_t> FitCall::rehearse(const FitOptions& options, kernels::FitnessEvaluator& evaluator, EvaluatorPair& pair) {
  constexpr std::size_t kPoints = 64;
  constexpr models::SyntheticMix kOneModel{1, 9};
  const std::vector<float> values = models::synthetic_points(options.model, kPoints, options.seed, kOneModel);
  if (values.empty()) return std::size_t{0};
  const FitOptions small = rehearsal_of(options);
  const SwarmObserver nobody;
  const ModelCallback untold;
  Limits limits;
  limits.max_models = 1;
  auto kinds = std::make_shared<std::vector<Kind>>(make_kinds(small));
  const auto result = FitCall(small, std::move(kinds), evaluator, pair, nobody, untold, limits).run({values, dimension(options.model)}, {});
  if (!result) return tl::unexpected(result.error());
  return result->models.size();
}

Expected<FitResult> FitCall::run(const PointsView& points, const std::vector<Model>& warm_start) {
  if (auto done = take(points); !done) return tl::unexpected(done.error());
  if (auto done = choose_part(); !done) return tl::unexpected(done.error());
  FitResult result;
  if (auto done = settle_threshold(result); !done) return tl::unexpected(done.error());
  resolve(kinds_, options_, whole_.finite_count(), result.threshold);
  const bool twice = settings().searches > 1 && !part_searched_;
  auto found = twice ? search_twice(warm_start, result) : search(warm_start, result);
  if (!found) return tl::unexpected(found.error());
  if (auto done = finish(std::move(*found), result); !done) return tl::unexpected(done.error());
  result.seed = options_.seed;
  result.finite_points = whole_.finite_count();
  result.total_ms = std::chrono::duration<double, std::milli>(Clock::now() - limits_.start).count();
  return result;
}

Expected<> FitCall::take(const PointsView& points) {
  if (points.dimension() != columns_of(options_)) {
    return fail(Error::Kind::bad_input, fmt::format("points have {} columns, must have {} to fit a {}", points.dimension(),
                                                    columns_of(options_), kinds_.front().space->title()));
  }
  auto whole = survey(evaluator_, points);
  if (!whole) return tl::unexpected(whole.error());
  whole_ = std::move(*whole);
  if (auto ok = check_points(points, whole_, kinds_); !ok) return ok;
  resolve(kinds_, options_, whole_.finite_count(), 1.0);
  return settings().stands_for > 1 ? thin() : Expected<>();
}

Expected<> FitCall::thin() {
  const kernels::Reused<std::uint32_t> drawn = draw_part(whole_, Random(options_.seed), kThinnedPart, settings().fit_points, &evaluator_);
  thin_rows_.emplace(whole_.view(), drawn, &evaluator_);
  auto looked_at = survey(evaluator_, thin_rows_->view());
  if (!looked_at) return tl::unexpected(looked_at.error());
  thin_ = std::move(*looked_at);
  return {};
}

Expected<> FitCall::choose_part() {
  part_searched_ = settings().searches_part(working().finite_count());
  if (options_.noise != Noise::none) depth_ = near_depth(working());
  spread_ = spread_of(options_.noise, working(), depth_);
  const std::size_t size = part_searched_ ? settings().search_points : kSampledFrom;
  const auto steadiness = part_searched_ ? std::span<const float>(spread_) : std::span<const float>();
  part_ = part_to_look_at(working(), Random(options_.seed), size, &evaluator_, steadiness);
  if (!looks_later()) learn_neighbourhoods(*part_, working(), keenest(kinds_), &evaluator_);
  return check_backend(evaluator_, kinds_, part_searched_ ? part_->points.index().size() : working().size());
}

bool FitCall::looks_later() const { return kinds_.size() > 1 && fixed_threshold(options_).has_value(); }

Expected<> FitCall::settle_threshold(FitResult& result) {
  if (const auto fixed = fixed_threshold(options_)) {
    result.threshold = *fixed;
    return {};
  }
  auto estimated = estimate_threshold(evaluator_, working(), *part_, whole_.finite_count(), options_, watch(), spread_);
  if (!estimated) return tl::unexpected(estimated.error());
  result.threshold = estimated->threshold;
  points_set_ = true;
  // The preset of the paper finds each model by a search of its own.
  if (options_.preset == Preset::fast) known_ = std::move(estimated->models);
  return {};
}

FitCall::Found FitCall::found_by(const MultiModel& search) {
  Found found{search.found(), search.hidden(), {}, search.labels()};
  for (const models::Placed& model : found.models) found.corners.push_back(search.problem().corner(*model.space));
  found.shares_points = search.problem().shares_points(!found.hidden.empty());
  found.hidden_owns = search.problem().hidden_owns();
  return found;
}

Expected<FitCall::Found> FitCall::search(const std::vector<Model>& warm_start, FitResult& result) {
  MultiModel search(evaluator_, kinds_, working(), *part_, options_.seed, limits_, spread_);
  search.watched_by(watch());
  if (points_set_) search.points_are_set();
  if (looks_later()) {
    search.learn_after_planes(
        [&](std::span<const float> left) { learn_neighbourhoods(*part_, working(), keenest(kinds_), &evaluator_, left); });
  }
  if (auto done = search.run(on_model_, warm_start, result, known_); !done) return tl::unexpected(done.error());
  return found_by(search);
}

Expected<FitCall::Found> FitCall::search_twice(const std::vector<Model>& warm_start, FitResult& result) {
  // One after the other on a device there is but one of, or under an observer's eyes.
  const bool apart = watch() == nullptr && evaluator_.identity().backend == "cpu";
  if (apart) {
    if (auto made = pair_.make(); !made) return tl::unexpected(made.error());
  }
  std::stop_source stop_again;
  const std::stop_callback pass_on(limits_.stop, [&] { stop_again.request_stop(); });
  Limits limits_again = limits_;
  limits_again.stop = stop_again.get_token();
  MultiModel first(apart ? pair_.first() : evaluator_, kinds_, working(), *part_, options_.seed, limits_, spread_);
  MultiModel again(apart ? pair_.second() : evaluator_, kinds_, working(), *part_, options_.seed, limits_again, spread_);
  first.watched_by(watch());
  again.watched_by(watch());
  if (points_set_ && !apart) first.points_are_set();
  auto done = swarm::search_twice(first, again, stop_again, apart ? &evaluator_ : nullptr, on_model_, warm_start, result, known_);
  if (!done) return tl::unexpected(done.error());
  return found_by(first);
}

Expected<> FitCall::finish(Found found, FitResult& result) {
  const auto tau = static_cast<float>(result.threshold);
  const kernels::Reused<float> allowed = allowed_by(thin_rows_ ? spread_of(options_.noise, whole_, depth_) : spread_, tau);
  const Ground ground{.evaluator = evaluator_, .space = *kinds_.front().space, .points = whole_, .tau = tau, .allowed = allowed};
  if (thin_rows_) {
    found.models = moved(std::move(found.models), thin_.frame(), whole_.frame());
    found.hidden = moved(std::move(found.hidden), thin_.frame(), whole_.frame());
    found.labels.clear();
    if (auto done = refit(ground, found.models, found.shares_points, found.hidden); !done) return done;
  }
  if (settings().refine && options_.preset == Preset::fast) {
    if (auto done = refine_along(ground, found.models, found.hidden); !done) return done;
  }
  if (!found.hidden_owns) found.hidden.clear();
  result.labels.assign(found.labels.begin(), found.labels.end());
  return settle(ground, found.models, found.hidden, found.corners, result);
}

}  // namespace swarmfit::swarm
