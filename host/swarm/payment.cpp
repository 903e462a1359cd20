#include "host/swarm/payment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

namespace swarmfit::swarm {

Support count_support(std::span<const float> distances, std::span<const float> caps, float tau, std::span<const std::uint8_t> beside,
                      const Support& before, std::span<const float> nearest) {
  kernels::SlabCounts counts;
  kernels::count_slabs({distances, caps, beside, nearest, tau, kUnexplained * tau}, counts);
  Support s = before;
  s.unexplained += counts.open;
  std::transform(counts.slabs.begin(), counts.slabs.end(), s.slabs.begin(), s.slabs.begin(), std::plus<>());
  s.square += counts.square;
  s.inner += counts.inner;
  s.beside += counts.marked;
  s.shared += counts.shared;
  return s;
}

namespace {

/// `share` of n points lie where chance puts a share of `chance`.
double log_false_alarms(double n, double share, double chance, int minimal_sample) {
  // One point is added so that an empty background does not make everything certain.
  const double k = share / n, p = std::min(0.5, (chance + 1.0) / n);
  const double tests = minimal_sample * std::log(std::max(n, 2.0));
  if (k <= p) return tests;
  const double divergence = k * std::log(k / p) + (k < 1 ? (1 - k) * std::log((1 - k) / (1 - p)) : 0.0);
  return tests - n * divergence;
}

}  // namespace

double log_false_alarms(const Support& support, int minimal_sample, double least_background) {
  if (support.inliers() == 0) return 1e300;
  // A swarm finds the place where a gap on either side flatters the model, so what is farther off has a say as well.
  const auto wide = static_cast<double>(std::accumulate(support.slabs.begin() + 1, support.slabs.end(), std::size_t{0}));
  const double background =
      std::max({static_cast<double>(support.band()) / 2, wide / static_cast<double>(Support::kSlabs - 1), least_background});
  return log_false_alarms(static_cast<double>(support.unexplained), static_cast<double>(support.inliers()), background, minimal_sample);
}

namespace {

constexpr double kLogFalseAlarms = -4.605170185988091;  // log 0.01: one invented model in a hundred clouds of noise

bool has_enough(const Support& support, const Settings& settings) {
  const auto own = static_cast<double>(support.inliers()), least = static_cast<double>(settings.min_inliers);
  return support.inliers() + support.shared >= settings.min_inliers && own >= kOwnShare * least;
}

/// Points of the whole cloud that so many stand for.
std::size_t on_whole_cloud(std::size_t n, const Settings& settings) {
  return static_cast<std::size_t>(static_cast<double>(n) * settings.stands_for);
}

}  // namespace

bool pays_among_others(const Support& support, const Settings& settings, int minimal_sample, double strewn) {
  if (!has_enough(support, settings)) return false;
  Support whole;
  whole.unexplained = on_whole_cloud(support.unexplained, settings);
  std::transform(support.slabs.begin(), support.slabs.end(), whole.slabs.begin(),
                 [&](std::size_t n) { return on_whole_cloud(n, settings); });
  return log_false_alarms(whole, minimal_sample, strewn * static_cast<double>(whole.unexplained)) < kLogFalseAlarms;
}

bool pays_across(const Support& support, const Support& whole, const Settings& settings, int minimal_sample, double strewn) {
  constexpr double kNearly = 3;  // log of false alarms: chance alone seldom comes so near
  return support.inliers() >= settings.min_inliers && 2 * support.inliers() >= whole.inliers() &&
         log_false_alarms(support, minimal_sample, strewn * static_cast<double>(support.unexplained)) <= kNearly &&
         pays_among_others(whole, settings, minimal_sample, strewn);
}

bool pays(const Support& support, const Settings& settings, int minimal_sample, double strewn) {
  if (!has_enough(support, settings)) return false;
  if (pays_among_others(support, settings, minimal_sample, strewn)) return true;
  if (2 * support.beside > support.inliers()) return false;
  const auto inner = static_cast<double>(on_whole_cloud(support.inner, settings));
  const auto unexplained = static_cast<double>(on_whole_cloud(support.unexplained, settings));
  const double ring = static_cast<double>(on_whole_cloud(support.inliers(), settings)) - inner;
  return log_false_alarms(unexplained, inner, std::max(ring, strewn * unexplained / 2), minimal_sample) < kLogFalseAlarms;
}

}  // namespace swarmfit::swarm
