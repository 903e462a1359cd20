#include "host/swarm/noise_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/swarm/kinds.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kSigmas = 2.5;     // 98.8 % of a Gaussian lie within
constexpr double kGenerous = 0.08;  // first threshold, in units of the cloud's own spread
constexpr double kLeast = 1e-6;     // no threshold below this, in the same units: float coordinates carry no more
constexpr double kSettled = 0.05;   // relative change of the threshold below which it stays
constexpr double kAlike = 0.25;     // one below which a search would find the same models
constexpr int kFreeSteps = 2;       // of the threshold; further ones go half the way, for it may swing between two models' noise
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

/// Sigma that the points within reach of the models show, each of its nearest one.
Expected<double> common_sigma(const Ground& ground, std::span<const models::Placed> models, std::vector<float>& distances,
                              std::vector<float>& nearest) {
  std::fill(nearest.begin(), nearest.end(), std::numeric_limits<float>::infinity());
  for (const auto& [space, theta] : models) {
    if (auto done = weigh(ground.of(*space), theta, {}, distances); !done) return tl::unexpected(done.error());
    take_nearer(distances, nearest);
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] *= ground.tau / ground.allowed_at(i);
  const auto tau = static_cast<double>(ground.tau);
  return gaussian_part(nearest, tau / kSigmas, 2 * tau);
}

std::vector<Known> as_known(std::vector<models::Placed>& found, std::span<const Kind> kinds, const FitResult& result) {
  std::vector<Known> known;
  for (std::size_t m = 0; m < found.size(); ++m) {
    known.push_back({place_of(found[m], kinds), std::move(found[m].theta), result.models[m].iterations});
  }
  return known;
}

bool near(double a, double b, double share) { return std::abs(a - b) <= share * b; }

}  // namespace

Expected<NoiseScale> estimate_threshold(kernels::FitnessEvaluator& evaluator, const models::WorkingPoints& points, const Part& part,
                                        std::size_t finite_points, const FitOptions& options, Watch* watch, std::span<const float> spread) {
  std::vector<Kind> kinds = make_kinds(options);
  std::erase_if(kinds, [](const Kind& kind) { return kind.hidden; });  // a line taken for a wide circle has its noise all the same
  const double unit = points.frame().scale;
  double tau = kGenerous * unit;
  std::vector<Known> known;
  std::vector<float> distances(points.size()), nearest(points.size()), caps(points.size());
  for (int round = 0; round < kRounds; ++round) {
    resolve(kinds, options, finite_points, tau);
    for (Kind& kind : kinds) kind.settings.sharpen = false;  // what follows fits the models anew
    const Settings& settings = kinds.front().settings;
    Limits limits;
    limits.max_models = kModels;
    MultiModel search(evaluator, kinds, points, part, options.seed + static_cast<std::uint64_t>(round) + 1, limits, spread);
    search.watched_by(watch);
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
      const std::vector<float> allowed = allowed_by(spread, static_cast<float>(tau));
      const Ground ground{
          .evaluator = evaluator, .space = *kinds.front().space, .points = points, .tau = static_cast<float>(tau), .allowed = allowed};
      if (step > 0) {
        for (std::size_t i = 0; i < caps.size(); ++i) caps[i] = points.finite(i) ? ground.allowed_at(i) : 0.0F;
        for (auto& [space, theta] : found) {
          if (auto done = refine_one(ground.of(*space), settings.loss, caps, theta); !done) return tl::unexpected(done.error());
        }
      }
      const auto sigma = common_sigma(ground, found, distances, nearest);
      if (!sigma) return tl::unexpected(sigma.error());
      const double next = std::max(kSigmas * *sigma, kLeast * unit);
      const bool settled = near(next, tau, kSettled);
      tau = step < kFreeSteps ? next : std::sqrt(tau * next);
      if (settled) break;
    }
    known = as_known(found, kinds, result);
    if (near(tau, searched, kAlike)) break;
  }
  return NoiseScale{tau, std::move(known)};
}

}  // namespace swarmfit::swarm
