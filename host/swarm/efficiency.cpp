#include "host/swarm/efficiency.hpp"

#include <algorithm>
#include <cmath>

namespace swarmfit::swarm {
namespace {

constexpr double kLeastCut = 1.5;  // deviations; closer than that a Gaussian's top is flat for all that data tell

double density(double z) { return std::exp(-0.5 * z * z) * 0.3989422804014327; }
/// Probability of |z| < a, and mean of z^2 over it.
double within(double a) { return std::erf(a * 0.7071067811865476); }
double square_within(double a) { return within(a) - 2 * a * density(a); }

}  // namespace

double untruncated_deviation(double rms, double cut) {
  constexpr int kRounds = 50;
  const double most = cut / kLeastCut;
  double sigma = std::min(rms, most);
  for (int round = 0; round < kRounds; ++round) {
    const double a = cut / sigma, next = std::min(most, rms / std::sqrt(square_within(a) / within(a)));
    const bool settled = std::abs(next - sigma) <= 1e-6 * sigma;
    sigma = next;
    if (settled) break;
  }
  return sigma;
}

double variance_beside_least_squares(double corner, double cut) {
  const double t = std::max(cut, kLeastCut), k = std::clamp(corner, 1e-4, t);
  const double square = square_within(k) + k * k * (within(t) - within(k));
  const double slope = within(k) - 2 * k * density(t);  // the drop at the cut counts against it
  return square / (slope * slope);
}

}  // namespace swarmfit::swarm
