#include "host/swarm/noise_scale.hpp"

#include <algorithm>
#include <cmath>

#include "host/swarm/multi_model.hpp"
#include "host/swarm/settle.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kSigmas = 2.5;     // 98.8 % of a Gaussian lie within
constexpr double kGenerous = 0.08;  // first threshold, in units of the cloud's own spread
constexpr double kLeast = 1e-6;     // no threshold below this, in the same units: float coordinates carry no more
constexpr int kRounds = 10;
constexpr std::size_t kModels = 4;  // the most prominent ones tell the scale

}  // namespace

double gaussian_part(std::span<const float> distances, double guess, double reach) {
  std::vector<double> d;
  for (const float v : distances) {
    if (v <= reach) d.push_back(static_cast<double>(v));
  }
  if (d.empty()) return 0;
  double sigma = guess, share = 0.5;
  for (int round = 0; round < 60; ++round) {
    // |d| of a Gaussian has density 2 N(d; 0, sigma) on d >= 0; the background 1 / reach.
    const double peak = 2.0 / (sigma * 2.5066282746310002);
    double mass = 0, square = 0;
    for (const double v : d) {
      const double inlier = share * peak * std::exp(-0.5 * v * v / (sigma * sigma));
      const double p = inlier / (inlier + (1 - share) / reach);
      mass += p;
      square += p * v * v;
    }
    if (!(mass > 0)) return 0;
    const double next = std::sqrt(square / mass);
    share = std::clamp(mass / static_cast<double>(d.size()), 1e-3, 1 - 1e-3);
    const bool settled = std::abs(next - sigma) <= 1e-4 * sigma;
    sigma = std::max(next, 1e-12 * reach);
    if (settled) break;
  }
  return sigma;
}

Expected<double> estimate_threshold(kernels::FitnessEvaluator& evaluator, const models::ModelSpace& space,
                                    const models::WorkingPoints& points, const Part& part, std::size_t finite_points,
                                    const FitOptions& options) {
  const double unit = points.frame().scale;
  double tau = kGenerous * unit;
  std::vector<float> distances(points.size());
  for (int round = 0; round < kRounds; ++round) {
    const Settings settings = resolve(options, finite_points, tau);
    Limits limits;
    limits.max_models = kModels;
    MultiModel search(evaluator, space, points, part, settings, options.seed + static_cast<std::uint64_t>(round) + 1, limits);
    FitResult result;
    if (auto done = search.run({}, {}, result); !done) return tl::unexpected(done.error());
    const Ground ground{evaluator, space, points, static_cast<float>(tau)};
    if (auto done = settle(ground, search.found(), result); !done) return tl::unexpected(done.error());
    // Median over the models' points: each model votes with what it holds.
    std::vector<std::pair<double, std::size_t>> votes;
    std::size_t total = 0;
    for (std::size_t m = 0; m < result.models.size(); ++m) {
      if (auto done = weigh(ground, search.found()[m], {}, distances); !done) return tl::unexpected(done.error());
      votes.emplace_back(gaussian_part(distances, tau / kSigmas, 2 * tau), result.models[m].inliers);
      total += result.models[m].inliers;
    }
    if (votes.empty()) {  // so wide that nothing stands out from what surrounds it
      tau /= 2;
      continue;
    }
    std::sort(votes.begin(), votes.end());
    std::size_t below = 0;
    double sigma = votes.back().first;
    for (const auto& [value, weight] : votes) {
      below += weight;
      if (2 * below >= total) {
        sigma = value;
        break;
      }
    }
    const double next = std::max(kSigmas * sigma, kLeast * unit);
    const bool settled = std::abs(next - tau) <= 0.05 * tau;
    tau = next;
    if (settled) break;
  }
  return tau;
}

}  // namespace swarmfit::swarm
