#include "host/swarm/payment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace swarmfit::swarm {

double saved(std::span<const float> caps, std::span<const float> distances) {
  double sum = 0;
  for (std::size_t i = 0; i < caps.size(); ++i) sum += distances[i] < caps[i] ? static_cast<double>(caps[i] - distances[i]) : 0.0;
  return sum;
}

namespace {

/// Points that are counted at a time, in plain loops that compilers turn into vectors.
constexpr std::size_t kStrip = 256;
constexpr std::size_t kStrands = 8;
constexpr auto kFarther = static_cast<float>(Support::kSlabs);  // the slab of all that is farther
constexpr float kExplained = kFarther + 1;                      // and of what takes no part

int count_below(const std::array<float, kStrip>& values, float edge) {
  int count = 0;
  for (const float value : values) count += value < edge ? 1 : 0;
  return count;
}

}  // namespace

Support count_support(std::span<const float> distances, std::span<const float> caps, float tau, std::span<const float> found) {
  const float half = 0.5F * tau, least = kUnexplained * tau, reach = kFarther * tau, per_tau = 1 / tau;
  std::array<std::size_t, Support::kSlabs> below{};  // of the first slab, of the first two, and so on
  std::array<double, kStrands> square{};
  Support s;
  for (std::size_t first = 0; first < distances.size(); first += kStrip) {
    const std::size_t count = std::min(kStrip, distances.size() - first);
    const float *distance = distances.data() + first, *cap = caps.data() + first;
    std::array<float, kStrip> slab, own;
    slab.fill(kExplained);
    own.fill(0);
    for (std::size_t i = 0; i < count; ++i) {
      // Comparisons that a NaN fails.
      const float scaled = distance[i] * per_tau, near = scaled < kFarther ? scaled : kFarther;
      slab[i] = (cap[i] >= least) & (distance[i] >= 0) ? near : kExplained;
    }
    for (std::size_t i = 0; i < count; ++i) own[i] = slab[i] < 1 ? distance[i] : 0.0F;
    for (std::size_t k = 0; k < below.size(); ++k) below[k] += static_cast<std::size_t>(count_below(slab, static_cast<float>(k + 1)));
    s.unexplained += static_cast<std::size_t>(count_below(slab, kExplained));
    for (std::size_t i = 0; i < kStrip; i += kStrands) {
      for (std::size_t strand = 0; strand < kStrands; ++strand) {
        square[strand] += static_cast<double>(own[i + strand]) * static_cast<double>(own[i + strand]);
      }
    }
    int inner = 0, beside = 0;
    for (std::size_t i = 0; i < count; ++i) inner += (slab[i] < 1) & (distance[i] < half) ? 1 : 0;
    for (std::size_t i = 0; i < count && !found.empty(); ++i) beside += (slab[i] < 1) & (found[first + i] < reach) ? 1 : 0;
    s.inner += static_cast<std::size_t>(inner);
    s.beside += static_cast<std::size_t>(beside);
  }
  s.square = std::accumulate(square.begin(), square.end(), 0.0);
  std::adjacent_difference(below.begin(), below.end(), s.slabs.begin());
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

double log_false_alarms(const Support& support, int minimal_sample) {
  if (support.inliers() == 0) return 1e300;
  // A swarm finds the place where a gap on either side flatters the model, so what is farther off has a say as well.
  const auto wide = static_cast<double>(std::accumulate(support.slabs.begin() + 1, support.slabs.end(), std::size_t{0}));
  const double background = std::max(static_cast<double>(support.band()) / 2, wide / static_cast<double>(Support::kSlabs - 1));
  return log_false_alarms(static_cast<double>(support.unexplained), static_cast<double>(support.inliers()), background, minimal_sample);
}

bool pays(const Support& support, const Settings& settings, int minimal_sample) {
  constexpr double kLogFalseAlarms = -4.605170185988091;  // log 0.01: one invented model in a hundred clouds of noise
  if (support.inliers() < settings.min_inliers) return false;
  // As it would be on the whole cloud.
  Support whole;
  const auto scaled = [&](std::size_t n) { return static_cast<std::size_t>(static_cast<double>(n) * settings.stands_for); };
  whole.unexplained = scaled(support.unexplained);
  std::transform(support.slabs.begin(), support.slabs.end(), whole.slabs.begin(), scaled);
  if (log_false_alarms(whole, minimal_sample) < kLogFalseAlarms) return true;
  if (2 * support.beside > support.inliers()) return false;
  const auto inner = static_cast<double>(scaled(support.inner)), ring = static_cast<double>(whole.inliers()) - inner;
  return log_false_alarms(static_cast<double>(whole.unexplained), inner, ring, minimal_sample) < kLogFalseAlarms;
}

}  // namespace swarmfit::swarm
