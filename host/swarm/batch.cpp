// Many small fits side by side: a fitter a thread, each with one thread of its own.
#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/batch.hpp>

#include "host/common/parallel.hpp"

namespace swarmfit {
namespace {

constexpr std::size_t kMostClouds = 1U << 30;
constexpr int kShares = 64;  // parts that the clouds are taken in, so that a few slow ones hold nobody up
constexpr int kLargestPart = 64;

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
  void give(Fitter fitter) {
    const std::lock_guard lock(mutex_);
    fitters_.push_back(std::move(fitter));
  }

 private:
  FitOptions options_;
  std::mutex mutex_;
  std::vector<Fitter> fitters_;
};

}  // namespace

Expected<std::vector<Expected<FitResult>>> fit_batch(std::span<const PointsView> clouds, const FitOptions& options) {
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
    std::transform(clouds.begin(), clouds.end(), results.begin(), [&](const PointsView& cloud) { return first->fit(cloud); });
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
}

}  // namespace swarmfit
