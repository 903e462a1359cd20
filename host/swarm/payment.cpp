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

void mark_beside(std::span<const float> distances, float tau, std::span<std::uint8_t> beside) {
  const float reach = static_cast<float>(Support::kSlabs) * tau;
  for (std::size_t i = 0; i < beside.size(); ++i) beside[i] |= distances[i] < reach ? 1 : 0;
}

Support count_support(std::span<const float> distances, std::span<const float> caps, float tau, std::span<const std::uint8_t> beside,
                      const Support& before, std::span<const float> nearest) {
  // The last place is for all that is farther, or NaN; one more for what is explained already.
  constexpr auto kFarther = static_cast<float>(Support::kSlabs);
  std::array<std::size_t, Support::kSlabs + 2> counts{};
  const float half = 0.5F * tau, least = kUnexplained * tau, reach = kFarther * tau, per_tau = 1 / tau;
  Support s = before;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const float d = distances[i];
    const bool unexplained = caps[i] >= least && !std::isnan(d);
    const float slab = d < reach ? d * per_tau : kFarther;
    const std::size_t place = unexplained ? static_cast<std::size_t>(std::min(slab, kFarther)) : Support::kSlabs + 1;
    ++counts[place];
    s.shared += !unexplained && d < tau && !nearest.empty() && nearest[i] < tau && d < nearest[i] ? 1 : 0;
    if (place != 0) continue;
    s.square += static_cast<double>(d) * static_cast<double>(d);
    s.inner += d < half ? 1 : 0;
    s.beside += beside.empty() ? 0 : beside[i];
  }
  s.unexplained += distances.size() - counts[Support::kSlabs + 1];
  for (std::size_t k = 0; k < Support::kSlabs; ++k) s.slabs[k] += counts[k];
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

bool pays(const Support& support, const Settings& settings, int minimal_sample) {
  constexpr double kLogFalseAlarms = -4.605170185988091;  // log 0.01: one invented model in a hundred clouds of noise
  const auto own = static_cast<double>(support.inliers()), least = static_cast<double>(settings.min_inliers);
  if (support.inliers() + support.shared < settings.min_inliers || own < kOwnShare * least) return false;
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
