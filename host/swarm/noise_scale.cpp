#include "host/swarm/noise_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "host/swarm/kinds.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/noise_model.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/refinement.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kSigmas = 2.5;          // 98.8 % of a Gaussian lie within
constexpr double kReach = 3;             // thresholds: how far about the models points tell the noise from what surrounds it
constexpr double kGenerous = 0.08;       // first threshold, in units of the cloud's own spread
constexpr double kLeast = 1e-6;          // no threshold below this, in the same units: float coordinates carry no more
constexpr double kSettled = 0.02;        // relative change of the threshold below which it stays
constexpr double kAlike = 0.25;          // one below which a search would find the same models
constexpr int kFreeSteps = 2;            // of the threshold; further ones go half the way, for it may swing between two models' noise
constexpr int kRounds = 10;              // of search
constexpr int kSteps = 10;               // of models and threshold in turn, after each
constexpr double kWidest = 0.25;         // of the cloud's width: a slab that has half the cloud within it tells no noise
constexpr double kWidened = 2;           // times what a search started with: it went the wrong way, or started far too narrow
constexpr double kDoubt = 1.5;           // times as significant as another must such a one be
constexpr int kStarts = 3;               // thresholds that a search may start with, each half the one before
constexpr std::size_t kModels = 4;       // the most prominent ones tell the scale,
constexpr std::size_t kFlatModels = 12;  // and of lines more: their swarms are short, and what they find opens the fit's list
constexpr std::size_t kFirstModels = 2;  // at first, when the scale is not known

}  // namespace

double gaussian_part(std::span<const float> distances, double guess, double reach) {
  kernels::Reused<double> d;
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
Expected<double> common_sigma(const Ground& ground, std::span<const models::Placed> models, std::vector<float>& nearest) {
  auto distances = measure(ground, models);
  if (!distances) return tl::unexpected(distances.error());
  std::fill(nearest.begin(), nearest.end(), std::numeric_limits<float>::infinity());
  for (const std::vector<float>& one : *distances) take_nearer(one, nearest);
  for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] *= ground.tau / ground.allowed_at(i);
  const auto tau = static_cast<double>(ground.tau);
  return gaussian_part(nearest, tau / kSigmas, kReach * tau);
}

std::vector<Known> as_known(std::vector<models::Placed>& found, std::span<const Kind> kinds, const FitResult& result) {
  std::vector<Known> known;
  for (std::size_t m = 0; m < found.size(); ++m) {
    known.push_back({place_of(found[m], kinds), std::move(found[m].theta), result.models[m].iterations});
  }
  return known;
}

bool near(double a, double b, double share) { return std::abs(a - b) <= share * b; }

/// Looks for models and for the threshold that their own noise asks for, in turn.
class Estimate {
 public:
  struct Input {
    kernels::FitnessEvaluator& evaluator;
    const models::WorkingPoints& points;
    const Part& part;
    std::size_t finite_points;
    const FitOptions& options;
    Watch* watch;
    std::span<const float> spread;
  };

  explicit Estimate(const Input& input)
      : in_(input),
        kinds_(make_kinds(input.options)),
        distances_(input.points.size()),
        nearest_(input.points.size()),
        caps_(input.points.size()),
        width_(even_side(input.points.dimension()) * input.points.frame().scale) {
    std::erase_if(kinds_, [](const Kind& kind) { return kind.hidden; });  // a line taken for a wide circle has its noise all the same
  }

  Expected<NoiseScale> run() {
    const double unit = in_.points.frame().scale;
    NoiseScale best{kGenerous * unit, {}};
    double most = 0;
    int starts = 0;
    for (double start = best.threshold; starts < kStarts && rounds_ < kRounds; start /= 2) {
      auto settled = settle(start, starts > 0 ? most_models() : kFirstModels);
      if (!settled) return settled;
      if (settled->models.empty()) {  // so wide that nothing stands out from what surrounds it
        if (best.models.empty()) best.threshold = settled->threshold;
        continue;
      }
      auto weight = significance(*settled);
      if (!weight) return tl::unexpected(weight.error());
      const bool generous = starts == 0 && start == kGenerous * unit;
      const bool narrowed = settled->threshold <= (generous ? 1 - kAlike : 1 + kAlike) * start;
      // So much more it must be worth: several surfaces together fill a slab, too.
      if (settled->threshold > kWidened * start) *weight /= kDoubt;
      if (best.models.empty() || *weight > most) {
        most = *weight;
        best = std::move(*settled);
      }
      // A threshold that starts generous and stays or even widens may follow what surrounds the models. Several narrow ones are what it
      // must stand against then.
      if (narrowed) break;
      ++starts;
    }
    return best;
  }

 private:
  /// From one threshold on; no models where the first search finds none.
  /// The first looks for `at_first` models.
  Expected<NoiseScale> settle(double tau, std::size_t at_first) {
    NoiseScale now{tau, {}};
    bool widened = false;
    while (rounds_ < kRounds) {
      FitResult result;
      auto found = search(now.threshold, now.models.empty() ? at_first : most_models(), result);
      if (!found) return tl::unexpected(found.error());
      if (found->empty()) {
        if (now.models.empty()) {
          now.threshold /= 2;
          return now;
        }
        now.threshold *= widened ? 0.5 : 2.0;  // the models were followed into their own middle
        if (std::exchange(widened, true)) break;
        continue;
      }
      const double searched = now.threshold;
      if (auto done = follow(*found, now.threshold); !done) return tl::unexpected(done.error());
      now.models = as_known(*found, kinds_, result);
      if (near(now.threshold, searched, kAlike) || now.threshold > kWidest * width_) break;
    }
    return now;
  }

  std::size_t most_models() const { return kinds_.size() == 1 && kinds_.front().space->closed_form() ? kFlatModels : kModels; }

  Expected<std::vector<models::Placed>> search(double tau, std::size_t models, FitResult& result) {
    resolve(kinds_, in_.options, in_.finite_points, tau);
    for (Kind& kind : kinds_) {
      kind.settings.joint = false;  // what follows fits the models anew
      // Prominent models in closed form are hit by few samples.
      if (in_.options.particles || !kind.space->closed_form()) continue;
      kind.settings.starters /= 2;
      kind.settings.particles = std::min(kind.settings.particles, kind.settings.starters);
    }
    Limits limits;
    limits.max_models = models;
    const std::uint64_t seed = in_.options.seed + static_cast<std::uint64_t>(++rounds_);
    MultiModel search(in_.evaluator, kinds_, in_.points, in_.part, seed, limits, in_.spread);
    search.watched_by(in_.watch);
    if (rounds_ > 1) search.points_are_set();
    if (auto done = search.run({}, {}, result); !done) return tl::unexpected(done.error());
    return search.found();
  }

  /// The models follow the threshold and it follows them, without a search each time.
  Expected<> follow(std::vector<models::Placed>& found, double& tau) {
    const Settings& settings = kinds_.front().settings;
    for (int step = 0; step < kSteps; ++step) {
      const kernels::Reused<float> allowed = allowed_by(in_.spread, static_cast<float>(tau));
      const Ground ground = ground_at(tau, allowed);
      if (step > 0) {
        cap_all(ground, caps_);
        for (auto& [space, theta] : found) {
          if (auto done = refine_one(ground.of(*space), settings.loss, caps_, theta); !done) return tl::unexpected(done.error());
        }
      }
      const auto sigma = common_sigma(ground, found, nearest_);
      if (!sigma) return tl::unexpected(sigma.error());
      const double next = std::max(kSigmas * *sigma, kLeast * in_.points.frame().scale);
      const bool settled = near(next, tau, kSettled);
      tau = step < kFreeSteps ? next : std::sqrt(tau * next);
      if (settled) break;
    }
    return {};
  }

  /// How far from chance it is that so many points are within the threshold of any of the models: less the logarithm of their false alarms.
  /// What surrounds them is at least as dense as the cloud would be if its points were strewn evenly, so that a slab as wide as the cloud
  /// means nothing.
  Expected<double> significance(const NoiseScale& scale) {
    const auto tau = static_cast<float>(scale.threshold);
    const kernels::Reused<float> allowed = allowed_by(in_.spread, tau);
    const Ground ground = ground_at(scale.threshold, allowed);
    cap_all(ground, caps_);
    kernels::Reused<float> caps = caps_;
    for (std::size_t i = 0; i < caps.size(); ++i) caps[i] *= tau / ground.allowed_at(i);
    double evenly = 0, wide = 0;
    for (std::size_t i = 0; i < in_.points.size(); ++i) {
      if (!in_.points.finite(i)) continue;
      const auto each = static_cast<double>(ground.allowed_at(i));
      evenly += std::min(1.0, 2 * each / width_);
      wide += each;
    }
    if (wide > kWidest * width_ * static_cast<double>(in_.points.finite_count())) return 0.0;
    int sample = 0;
    std::fill(nearest_.begin(), nearest_.end(), std::numeric_limits<float>::infinity());
    for (const Known& model : scale.models) {
      const models::ModelSpace& space = *kinds_[model.kind].space;
      if (auto done = weigh(ground.of(space), model.theta, {}, distances_); !done) return tl::unexpected(done.error());
      take_nearer(distances_, nearest_);
      sample += space.minimal_sample();
    }
    for (std::size_t i = 0; i < nearest_.size(); ++i) nearest_[i] *= tau / ground.allowed_at(i);
    const Support support = count_support(nearest_, caps, tau);
    return -std::min(0.0, log_false_alarms(support, sample, evenly * static_cast<double>(scale.models.size())));
  }

  Ground ground_at(double tau, std::span<const float> allowed) const {
    return {.evaluator = in_.evaluator,
            .space = *kinds_.front().space,
            .points = in_.points,
            .tau = static_cast<float>(tau),
            .allowed = allowed};
  }

  Input in_;
  std::vector<Kind> kinds_;
  kernels::Reused<float> distances_, nearest_, caps_;
  double width_;    // of the cloud, were its points strewn evenly [data unit]
  int rounds_ = 0;  // of search, so far
};

}  // namespace

Expected<NoiseScale> estimate_threshold(kernels::FitnessEvaluator& evaluator, const models::WorkingPoints& points, const Part& part,
                                        std::size_t finite_points, const FitOptions& options, Watch* watch, std::span<const float> spread) {
  return Estimate({evaluator, points, part, finite_points, options, watch, spread}).run();
}

}  // namespace swarmfit::swarm
