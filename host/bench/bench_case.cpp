#include "host/bench/bench_case.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include <fmt/format.h>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/noise_scale.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"
#include "host/swarm/swarm.hpp"
#include "kernels/evaluators.hpp"

namespace swarmfit::bench_internal {
namespace {

constexpr int kSteps = 10;
constexpr double kThreshold = 0.01;  // of a plane by default, and three times the spread above

/// Passes everything on and keeps a copy of each swarm it is asked about.
class Recorder final : public kernels::FitnessEvaluator {
 public:
  Recorder(std::unique_ptr<kernels::FitnessEvaluator> inner, std::vector<Step>& steps) : inner_(std::move(inner)), steps_(steps) {}

  const kernels::Identity& identity() const noexcept override { return inner_->identity(); }
  kernels::Support supports(const kernels::Workload& workload) const override { return inner_->supports(workload); }
  kernels::Result<> set_points(const kernels::PointsView& points) override { return inner_->set_points(points); }
  kernels::Result<> set_caps(std::span<const float> caps) override { return inner_->set_caps(caps); }
  kernels::Result<> evaluate(const kernels::SwarmView& swarm, kernels::Loss loss, std::span<const float> cutoffs,
                             std::span<float> costs) override {
    steps_.push_back({{swarm.parameters.begin(), swarm.parameters.end()}, {cutoffs.begin(), cutoffs.end()}, {}});
    return inner_->evaluate(swarm, loss, cutoffs, costs);
  }
  kernels::Result<> distances(const kernels::ModelView& model, std::span<float> distances) override {
    return inner_->distances(model, distances);
  }
  kernels::Result<> assign(std::span<const kernels::ModelView> models, std::span<const float> tolerance,
                           std::span<std::uint16_t> labels) override {
    return inner_->assign(models, tolerance, labels);
  }
  kernels::Effort effort() const noexcept override { return inner_->effort(); }

 private:
  std::unique_ptr<kernels::FitnessEvaluator> inner_;
  std::vector<Step>& steps_;
};

Expected<> fly(kernels::FitnessEvaluator& evaluator, const models::ModelSpace& space, models::WorkingPoints& working, std::size_t particles,
               std::uint64_t seed) {
  FitOptions options;
  options.model = space.type();
  swarm::Settings settings = swarm::resolve(options, working.finite_count(), kThreshold);
  settings.starters = settings.particles = static_cast<int>(particles);
  const swarm::Random random(seed);
  const swarm::Part part = swarm::look_closely(working, space, random, swarm::kSampledFrom);
  const swarm::Sampler sampler(working, part.points.index(), part.neighbours, space, random);
  swarm::Landscape landscape(evaluator, space, working.frame(), settings);
  swarm::Swarm swarm(space, settings, random);
  if (!swarm.start(sampler, 0, {})) {
    return fail(Error::Kind::bad_input,
                fmt::format("the {} points determine no {}: all samples are degenerate", working.size(), space.title()));
  }
  for (int step = 0; step < kSteps; ++step) {
    if (auto done = swarm.step(landscape, sampler, 1.0); !done) return done;
  }
  return {};
}

Expected<> add_reference(Case& made) {
  auto reference = kernels::make_reference_evaluator();
  if (!reference) return tl::unexpected(swarm::to_error(reference.error()));
  const auto ask = [&](Step& step) {
    step.reference.resize(made.particles);
    return (*reference)->evaluate({made.kind, made.particles, step.parameters}, kernels::Loss::truncated_l1, {}, step.reference);
  };
  auto done = (*reference)->set_points(models::to_kernel(made.points));
  if (done) done = (*reference)->set_caps(made.caps);
  if (done) done = ask(made.steps.front());
  if (done) done = ask(made.steps.back());
  if (!done) return tl::unexpected(swarm::to_error(done.error()));
  return {};
}

}  // namespace

Expected<Case> make_case(ModelType type, const PointsView& points, std::size_t particles, std::uint64_t seed, int threads) {
  models::WorkingPoints working(points);
  if (const auto stray = working.stray()) return fail(Error::Kind::bad_input, models::text_of(*stray));
  const auto space = models::make_space(type, std::nullopt);
  if (working.finite_count() < static_cast<std::size_t>(space->minimal_sample())) {
    return fail(Error::Kind::bad_input, fmt::format("finite points is {}, must be >= {} to bench a {}", working.finite_count(),
                                                    space->minimal_sample(), name(type)));
  }
  Case made;
  made.kind = space->kind();
  made.points = points;
  made.particles = particles;
  made.caps.assign(points.size(), static_cast<float>(kThreshold));
  made.nothing_explained = kThreshold * static_cast<double>(working.finite_count());
  kernels::EvaluatorOptions options;
  options.threads = threads;
  auto cpu = kernels::make_cpu_evaluator(options);
  if (!cpu) return tl::unexpected(swarm::to_error(cpu.error()));
  Recorder recorder(std::move(*cpu), made.steps);
  auto ready = recorder.set_points(models::to_kernel(points));
  if (ready) ready = recorder.set_caps(made.caps);
  if (!ready) return tl::unexpected(swarm::to_error(ready.error()));
  if (auto done = fly(recorder, *space, working, particles, seed); !done) return tl::unexpected(done.error());
  if (auto done = add_reference(made); !done) return tl::unexpected(done.error());
  return made;
}

}  // namespace swarmfit::bench_internal
