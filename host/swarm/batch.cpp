// Many small fits: side by side on the processor, a fitter a thread, each with one thread of its own; in step on a device.
#include <algorithm>
#include <mutex>
#include <new>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/batch.hpp>

#include "host/common/parallel.hpp"
#include "host/common/thrown.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/lock_step.hpp"

namespace swarmfit {
namespace {

constexpr std::size_t kMostClouds = 1U << 30;
constexpr int kShares = 64;  // parts that the clouds are taken in, so that a few slow ones hold nobody up
constexpr int kLargestPart = 64;
constexpr std::size_t kSmallCloud = 16384;  // a larger one fills a device by itself
constexpr int kManyParticles = 1024;
constexpr std::size_t kUnderWay = 128;  // fits in step, a thread each

/// Fitters that are not at work.
class Idle {
 public:
  Idle(FitOptions options, Fitter first) : options_(std::move(options)) { fitters_.push_back(std::move(first)); }

  Expected<Fitter> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!fitters_.empty()) {
        Fitter one = std::move(fitters_.back());
        fitters_.pop_back();
        return one;
      }
    }
    return Fitter::create(options_);
  }
  void give(Fitter fitter) noexcept {
    const std::lock_guard lock(mutex_);
    try {
      fitters_.push_back(std::move(fitter));
    } catch (const std::bad_alloc&) {
      // The next one is made anew.
    }
  }

 private:
  FitOptions options_;
  std::mutex mutex_;
  std::vector<Fitter> fitters_;
};

/// Can a batch take this cloud, whatever swarm the fit makes?
bool fits_batch(const kernels::BatchEvaluator& batch, const PointsView& cloud, std::span<const swarm::Kind> kinds, std::size_t particles) {
  return cloud.size() <= kSmallCloud && std::all_of(kinds.begin(), kinds.end(), [&](const swarm::Kind& kind) {
           return static_cast<bool>(batch.supports({kind.space->kind(), cloud.size(), particles}));
         });
}

/// On a Vulkan device: small clouds in step, the others one after another on the fitter.
Expected<> fit_on_device(std::span<const PointsView> clouds, const FitOptions& options, int threads, Fitter& fitter,
                         std::span<Expected<FitResult>> results) {
  std::vector<std::size_t> small, large;
  // What a time budget ends depends on who else is under way, and a model of one's own has shaders of its own.
  if (options.time_budget_ms <= 0 && !options.own) {
    kernels::EvaluatorOptions evaluation;
    evaluation.pipeline_cache = options.pipeline_cache;
    auto batch = kernels::make_batch_evaluator(options.backend, evaluation, std::clamp<std::size_t>(clouds.size(), 1, kUnderWay));
    if (!batch) return tl::unexpected(swarm::to_error(batch.error()));
    const std::vector<swarm::Kind> kinds = swarm::make_kinds(options);
    const auto particles = static_cast<std::size_t>(std::max(options.particles.value_or(0), kManyParticles));
    for (std::size_t k = 0; k < clouds.size(); ++k) (fits_batch(**batch, clouds[k], kinds, particles) ? small : large).push_back(k);
    std::vector<PointsView> views(small.size());
    std::vector<Expected<FitResult>> answers(small.size());
    std::transform(small.begin(), small.end(), views.begin(), [&](std::size_t k) { return clouds[k]; });
    if (!views.empty()) swarm::fit_in_step(views, options, threads, **batch, fitter.backend().reason, answers);
    for (std::size_t i = 0; i < small.size(); ++i) results[small[i]] = std::move(answers[i]);
  } else {
    large.resize(clouds.size());
    std::iota(large.begin(), large.end(), std::size_t{0});
  }
  for (const std::size_t k : large) results[k] = fitter.fit(clouds[k]);
  return {};
}

}  // namespace

Expected<std::vector<Expected<FitResult>>> fit_batch(std::span<const PointsView> clouds, const FitOptions& options) try {
  if (clouds.size() > kMostClouds) {
    return fail(Error::Kind::invalid_option, fmt::format("clouds.size() is {}, must be <= {}", clouds.size(), kMostClouds));
  }
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  FitOptions each = options;
  each.threads = 1;
  auto first = Fitter::create(each);
  if (!first) return tl::unexpected(first.error());
  std::vector<Expected<FitResult>> results(clouds.size());
  if (first->backend().name == "vulkan") {
    if (auto done = fit_on_device(clouds, each, options.threads, *first, results); !done) return tl::unexpected(done.error());
    return results;
  }
  // The reference is serial by its nature.
  const int threads = first->backend().name == "reference" ? 1 : options.threads;
  const int count = static_cast<int>(clouds.size());
  Idle idle(std::move(each), std::move(*first));
  common::in_parallel(count, std::clamp(count / kShares, 1, kLargestPart), threads, [&](int begin, int end) {
    auto fitter = idle.take();
    for (int k = begin; k < end; ++k) {
      const auto at = static_cast<std::size_t>(k);
      results[at] = fitter ? fitter->fit(clouds[at]) : tl::unexpected(fitter.error());
    }
    if (fitter) idle.give(std::move(*fitter));
  });
  return results;
} catch (...) {
  return common::error_of_thrown(Error::Kind::backend_unavailable, [&] { return fmt::format("no memory for {} clouds", clouds.size()); });
}

}  // namespace swarmfit
