#include "host/swarm/payment.hpp"

#include <algorithm>
#include <cmath>

namespace swarmfit::swarm {

Support count_support(std::span<const float> distances, std::span<const float> caps, float tau) {
  Support s;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (!(caps[i] >= 0.5F * tau) || std::isnan(distances[i])) continue;
    ++s.unexplained;
    if (distances[i] <= tau) {
      ++s.inliers;
    } else if (distances[i] <= 3 * tau) {
      ++s.band;
    }
  }
  return s;
}

double log_false_alarms(const Support& support, int minimal_sample) {
  if (support.inliers == 0) return 1e300;
  const auto n = static_cast<double>(support.unexplained);
  const double k = static_cast<double>(support.inliers) / n;
  // The band is twice as wide as the model; one point is added so that an empty band does not make everything certain.
  const double p = std::min(0.5, (0.5 * static_cast<double>(support.band) + 1.0) / n);
  const double tests = minimal_sample * std::log(std::max(n, 2.0));
  if (k <= p) return tests;
  const double divergence = k * std::log(k / p) + (k < 1 ? (1 - k) * std::log((1 - k) / (1 - p)) : 0.0);
  return tests - n * divergence;
}

bool pays(const Support& support, const Settings& settings, int minimal_sample) {
  constexpr double kLogFalseAlarms = -4.605170185988091;  // log 0.01: one invented model in a hundred clouds of noise
  if (support.inliers < settings.min_inliers) return false;
  const auto whole = [&](std::size_t n) { return static_cast<std::size_t>(static_cast<double>(n) * settings.stands_for); };
  return log_false_alarms({whole(support.inliers), whole(support.band), whole(support.unexplained)}, minimal_sample) < kLogFalseAlarms;
}

}  // namespace swarmfit::swarm
