// Fitness throughput: every row is checked against the reference, then timed on the positions of a real swarm.
#include <swarmfit/bench.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include <swarmfit/points.hpp>

#include "host/bench/bench_case.hpp"
#include "host/common/thrown.hpp"
#include "host/models/model_space.hpp"
#include "host/models/synthetic.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/evaluators.hpp"
#include "kernels/machine_limit.hpp"

namespace swarmfit {
namespace {

using bench_internal::Case;
using bench_internal::Step;
using Clock = std::chrono::steady_clock;

constexpr double kLimitSeconds = 0.05;
constexpr std::size_t kLeastRepetitions = 3;

std::vector<std::string> usable_backends() {
  std::vector<std::string> names;
  for (const kernels::DeviceDescription& device : kernels::list_devices()) {
    if (device.usable && device.backend != "reference") names.push_back(device.backend == "cpu" ? "cpu" : device.device);
  }
  return names;
}

Expected<kernels::Selection> make(const std::string& backend, int threads, bool pruning) {
  kernels::EvaluatorOptions options;
  options.threads = threads;
  options.pruning = pruning;
  auto made = kernels::make_evaluator(backend, options);
  if (!made) return tl::unexpected(swarm::to_error(made.error()));
  return std::move(*made);
}

/// All steps of a case through one evaluator; costs of each step go to `costs`.
class Replay {
 public:
  Replay(kernels::FitnessEvaluator& evaluator, const Case& what, bool pruning) : evaluator_(evaluator), case_(what), pruning_(pruning) {
    costs_.resize(case_.particles);
  }

  Expected<> ask(const Step& step) {
    const std::span<const float> cutoffs = pruning_ ? std::span<const float>(step.cutoffs) : std::span<const float>();
    auto done = evaluator_.evaluate({case_.kind, case_.particles, step.parameters}, kernels::Loss::truncated_l1, cutoffs, costs_);
    if (!done) return tl::unexpected(swarm::to_error(done.error()));
    return {};
  }

  /// Largest error relative to the cost of a model that explains nothing. With cutoffs, a losing model may answer anything from its
  /// cutoff to its true cost.
  Expected<double> error() {
    double worst = 0;
    for (const Step& step : case_.steps) {
      if (step.reference.empty()) continue;
      if (auto done = ask(step); !done) return tl::unexpected(done.error());
      for (std::size_t j = 0; j < costs_.size(); ++j) {
        const double truth = step.reference[j];
        const bool lost = pruning_ && costs_[j] >= step.cutoffs[j];
        const double off = lost ? std::max(0.0, costs_[j] - truth) : std::abs(costs_[j] - truth);
        worst = std::max(worst, off / case_.nothing_explained);
      }
    }
    return worst;
  }

  /// Seconds of one evaluation of the swarm: the median over repetitions of all steps.
  Expected<double> time(double seconds) {
    std::vector<double> each;
    const auto start = Clock::now();
    while (each.size() < kLeastRepetitions || std::chrono::duration<double>(Clock::now() - start).count() < seconds) {
      // As after each found model: what the steps of the time before taught the evaluator is forgotten.
      if (auto done = evaluator_.set_caps(case_.caps); !done) return tl::unexpected(swarm::to_error(done.error()));
      const auto begin = Clock::now();
      for (const Step& step : case_.steps) {
        if (auto done = ask(step); !done) return tl::unexpected(done.error());
      }
      each.push_back(std::chrono::duration<double>(Clock::now() - begin).count() / static_cast<double>(case_.steps.size()));
    }
    std::nth_element(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(each.size() / 2), each.end());
    return each[each.size() / 2];
  }

 private:
  kernels::FitnessEvaluator& evaluator_;
  const Case& case_;
  bool pruning_;
  std::vector<float> costs_;
};

class Bench {
 public:
  Bench(const BenchOptions& options, const std::function<void(const std::string&)>& progress) : options_(options), progress_(progress) {}

  Expected<> raise_limit() {
    const auto limit = kernels::measure_machine_limit(options_.threads, kLimitSeconds);
    if (!limit) return tl::unexpected(swarm::to_error(limit.error()));
    report_.fma_per_s = std::max(report_.fma_per_s, limit->fma_per_s);
    report_.threads = limit->threads;
    return {};
  }

  Expected<> run(const Case& what, const std::string& backend, bool pruning) {
    const kernels::ModelTraits& traits = kernels::traits(what.kind);
    const std::string title = fmt::format("{} {} {} points x {} particles{}", backend, traits.name, what.points.size(), what.particles,
                                          pruning ? ", pruning" : "");
    auto made = make(backend, options_.threads, pruning);
    if (!made) return tl::unexpected(made.error());
    kernels::FitnessEvaluator& evaluator = *made->evaluator;
    if (const auto support = evaluator.supports({what.kind, what.points.size(), what.particles}); !support) {
      tell(title + ": left out, " + support.reason);
      return {};
    }
    tell(title);
    if (auto done = raise_limit(); !done) return done;
    auto ready = evaluator.set_points(models::to_kernel(what.points));
    if (ready) ready = evaluator.set_caps(what.caps);
    if (!ready) return tl::unexpected(swarm::to_error(ready.error()));
    Replay replay(evaluator, what, pruning);
    const auto error = replay.error();
    if (!error) return tl::unexpected(error.error());
    if (!(*error <= kernels::kCostTolerance)) {
      return fail(Error::Kind::backend_unavailable,
                  fmt::format("{}: the costs are off the reference by {:.2g}, must be <= {:.2g}", title, *error, kernels::kCostTolerance));
    }
    const auto seconds = replay.time(options_.seconds);
    if (!seconds) return tl::unexpected(seconds.error());
    BenchRow row;
    row.backend = evaluator.identity().backend;
    row.device = evaluator.identity().device;
    row.model = traits.name;
    row.points = what.points.size();
    row.particles = what.particles;
    row.pruning = pruning;
    row.evaluations_per_s = static_cast<double>(row.points) * static_cast<double>(row.particles) / *seconds;
    row.max_relative_error = *error;
    row.seconds = *seconds;
    report_.rows.push_back(row);
    return {};
  }

  /// The limit is the best that the whole run saw, so that no row is flattered by a slow moment of the yardstick.
  BenchReport report() && {
    for (BenchRow& row : report_.rows) {
      const auto kind = kernels::model_kind(row.model);
      const double per_residual = kind ? kernels::traits(*kind).multiply_adds : 0;
      row.fraction_of_limit = row.evaluations_per_s * per_residual / report_.fma_per_s;
    }
    return std::move(report_);
  }

 private:
  void tell(const std::string& what) const {
    if (progress_) progress_(what);
  }

  const BenchOptions& options_;
  const std::function<void(const std::string&)>& progress_;
  BenchReport report_;
};

/// Every back end and pruning over one cloud.
Expected<> run_cloud(Bench& bench, const BenchOptions& options, ModelType type, const PointsView& points,
                     const std::vector<std::string>& backends) {
  for (const std::size_t particles : options.particles) {
    const auto what = bench_internal::make_case(type, points, particles, options.seed, options.threads);
    if (!what) return tl::unexpected(what.error());
    for (const std::string& backend : backends) {
      for (const bool pruning : options.pruning) {
        if (auto done = bench.run(*what, backend, pruning); !done) return done;
      }
    }
  }
  return {};
}

/// Rows that are finite: the others are no work, and would flatter every rate.
swarm::Rows finite_rows(const PointsView& cloud) {
  const models::WorkingPoints working(cloud);
  return {working.view(), swarm::draw_part(working, swarm::Random(0), swarm::kThinnedPart, working.finite_count())};
}

}  // namespace

Expected<> BenchOptions::validate() const {
  const auto invalid = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  for (const std::size_t n : points) {
    if (n < 1) return invalid(fmt::format("points is {}, must be >= 1", n));
  }
  for (const std::size_t m : particles) {
    if (m < 2 || m > 1'000'000) return invalid(fmt::format("particles is {}, must be in [2, 1000000]", m));
  }
  if (threads < 0 || threads > 4096) return invalid(fmt::format("threads is {}, must be in [0, 4096]", threads));
  if (!(seconds > 0 && std::isfinite(seconds))) return invalid(fmt::format("seconds is {}, must be finite and > 0", seconds));
  if (points.empty()) return invalid("points is empty, must hold a count");
  if (particles.empty()) return invalid("particles is empty, must hold a count");
  if (pruning.empty()) return invalid("pruning is empty, must hold on or off");
  return {};
}

Expected<BenchReport> bench(const BenchOptions& options, const PointsView* cloud,
                            const std::function<void(const std::string&)>& progress) try {
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  const std::vector<std::string> backends = options.backends.empty() ? usable_backends() : options.backends;
  for (const std::string& backend : backends) {
    // An unknown name is told before anything is timed.
    if (auto made = make(backend, options.threads, true); !made) {
      return tl::unexpected(made.error());
    }
  }
  std::vector<ModelType> types = options.models;
  if (types.empty()) {
    for (const ModelType type : model_types()) {
      if (!cloud || cloud->dimension() == dimension(type)) types.push_back(type);
    }
  }
  std::optional<swarm::Rows> rows;
  if (cloud) rows = finite_rows(*cloud);
  const std::function<void(const std::string&)> told = common::going_by(progress);
  Bench runner(options, told);
  if (auto done = runner.raise_limit(); !done) return tl::unexpected(done.error());
  for (const ModelType type : types) {
    if (cloud) {
      if (cloud->dimension() != dimension(type)) {
        return fail(Error::Kind::bad_input,
                    fmt::format("points have {} columns, must have {} to bench a {}", cloud->dimension(), dimension(type), name(type)));
      }
      auto done = run_cloud(runner, options, type, rows->view(), backends);
      // A cloud need not determine every kind of its dimension; only those that were asked for by name must be there.
      const bool undetermined = !done && done.error().kind == Error::Kind::bad_input && options.models.empty();
      if (!done && !undetermined) return tl::unexpected(done.error());
      continue;
    }
    for (const std::size_t count : options.points) {
      const std::vector<float> values = models::synthetic_points(type, count, options.seed);
      const PointsView points(std::span<const float>(values), dimension(type));
      if (auto done = run_cloud(runner, options, type, points, backends); !done) return tl::unexpected(done.error());
    }
  }
  return std::move(runner).report();
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [] { return std::string("no memory for the benchmark"); });
}

}  // namespace swarmfit
