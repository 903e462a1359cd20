#include "host/swarm/noise_scale.hpp"

#include <algorithm>
#include <cmath>

#include "host/swarm/kinds.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kSigmas = 2.5;     // 98.8 % of a Gaussian lie within
constexpr double kGenerous = 0.08;  // first threshold, in units of the cloud's own spread
constexpr double kLeast = 1e-6;     // no threshold below this, in the same units: float coordinates carry no more
constexpr double kSettled = 0.05;   // relative change of the threshold below which it stays
constexpr int kRounds = 10;         // of search
constexpr int kSteps = 10;          // of models and threshold in turn, after each
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

namespace {

/// Sigma as the models see it that the points within `tau` of them show: the weighted median, each model voting with what it holds. 0 without
/// models.
Expected<double> common_sigma(const Ground& ground, std::span<const models::Placed> models, std::vector<float>& distances) {
  std::vector<std::pair<double, std::size_t>> votes;
  std::size_t total = 0;
  for (const auto& [space, theta] : models) {
    const auto evidence = weigh(ground.of(*space), theta, {}, distances);
    if (!evidence) return tl::unexpected(evidence.error());
    const auto tau = static_cast<double>(ground.tau);
    votes.emplace_back(gaussian_part(distances, tau / kSigmas, 2 * tau), static_cast<std::size_t>(evidence->count));
    total += votes.back().second;
  }
  std::sort(votes.begin(), votes.end());
  std::size_t below = 0;
  for (const auto& [value, weight] : votes) {
    below += weight;
    if (2 * below >= total) return value;
  }
  return 0.0;
}

bool near(double a, double b) { return std::abs(a - b) <= kSettled * b; }

}  // namespace

Expected<double> estimate_threshold(kernels::FitnessEvaluator& evaluator, const models::WorkingPoints& points, const Part& part,
                                    std::size_t finite_points, const FitOptions& options) {
  std::vector<Kind> kinds = make_kinds(options);
  const double unit = points.frame().scale;
  double tau = kGenerous * unit;
  std::vector<float> distances(points.size()), caps(points.size());
  for (int round = 0; round < kRounds; ++round) {
    resolve(kinds, options, finite_points, tau);
    const Settings& settings = kinds.front().settings;
    Limits limits;
    limits.max_models = kModels;
    MultiModel search(evaluator, kinds, points, part, options.seed + static_cast<std::uint64_t>(round) + 1, limits);
    FitResult result;
    if (auto done = search.run({}, {}, result); !done) return tl::unexpected(done.error());
    std::vector<models::Placed> found = search.found();
    if (found.empty()) {  // so wide that nothing stands out from what surrounds it
      tau /= 2;
      continue;
    }
    // The models follow the threshold and it follows them, without a search each time; the next search starts where they have come to.
    const double searched = tau;
    for (int step = 0; step < kSteps; ++step) {
      const Ground ground{evaluator, *kinds.front().space, points, static_cast<float>(tau)};
      if (step > 0) {
        for (std::size_t i = 0; i < caps.size(); ++i) caps[i] = points.finite(i) ? ground.tau : 0.0F;
        for (auto& [space, theta] : found) {
          if (auto done = refine_one(ground.of(*space), settings.loss, caps, theta); !done) return tl::unexpected(done.error());
        }
      }
      const auto sigma = common_sigma(ground, found, distances);
      if (!sigma) return sigma;
      const double next = std::max(kSigmas * *sigma, kLeast * unit);
      const bool settled = near(next, tau);
      tau = next;
      if (settled) break;
    }
    if (near(tau, searched)) break;
  }
  return tau;
}

}  // namespace swarmfit::swarm
