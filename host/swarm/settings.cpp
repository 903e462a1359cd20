#include "host/swarm/settings.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "host/models/model_space.hpp"

namespace swarmfit {
namespace {

/// `ok` is false for NaN as well, if it is written as a positive comparison.
template <class T>
Expected<> require(bool ok, const char* field, const T& value, const char* bound) {
  if (ok) return {};
  return fail(Error::Kind::invalid_option, fmt::format("{} is {}, must be {}", field, value, bound));
}

bool positive(double v) { return v > 0 && std::isfinite(v); }

Expected<> check_prior(const DirectionPrior& prior) {
  if (!(prior.axis.allFinite() && prior.axis.norm() > 0)) {
    return fail(Error::Kind::invalid_option,
                fmt::format("prior.axis is ({}, {}, {}), must be finite and not zero", prior.axis.x(), prior.axis.y(), prior.axis.z()));
  }
  return require(prior.max_angle > 0 && prior.max_angle <= 1.5707963267948968, "prior.max_angle", prior.max_angle, "in (0, pi/2] rad");
}

Deflation deflation_of(const FitOptions& options) {
  return options.deflation.value_or(options.preset == Preset::paper ? Deflation::parametric : Deflation::residual);
}

/// What each of several kinds must be to compete for the same points.
Expected<> check_rivals(const FitOptions& options) {
  const auto refuse = [](ModelType rival, const std::string& bound) {
    return fail(Error::Kind::invalid_option, fmt::format("rivals holds {}, must hold {}", name(rival), bound));
  };
  for (std::size_t r = 0; r < options.rivals.size(); ++r) {
    const ModelType rival = options.rivals[r];
    const auto columns = dimension(options.model);
    if (dimension(rival) != columns) {
      return refuse(rival, fmt::format("only kinds of {} columns, as {} has; it has {}", columns, name(options.model), dimension(rival)));
    }
    if (columns > 3)
      return refuse(rival, fmt::format("nothing beside {}: of point pairs one kind is fitted at a time", name(options.model)));
    const auto before = options.rivals.begin() + static_cast<std::ptrdiff_t>(r);
    if (rival == options.model || std::find(options.rivals.begin(), before, rival) != before) return refuse(rival, "each kind once");
  }
  if (options.rivals.empty()) return {};
  if (deflation_of(options) == Deflation::parametric) {
    return fail(Error::Kind::invalid_option,
                fmt::format("deflation is parametric with {} kinds, must be residual (preset fast)", options.kinds().size()));
  }
  return {};
}

/// An own model is fitted by itself, and without Eq. (5): nobody knows how far apart two of it are.
Expected<> check_own(const FitOptions& options) {
  const auto refuse = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  const bool wanted = options.model == ModelType::own;
  if (!wanted && options.own) return refuse(fmt::format("model is {}, must be own where own is given", name(options.model)));
  if (!wanted) return {};
  if (!options.own) return refuse("own is empty, must be given where model is own");
  if (!options.rivals.empty()) {
    return refuse(fmt::format("rivals holds {}, must hold nothing beside an own model", name(options.rivals.front())));
  }
  if (deflation_of(options) == Deflation::parametric) {
    return refuse("deflation is parametric, must be residual for an own model (preset fast)");
  }
  return options.own->validate();
}

Expected<> check_noise(const FitOptions& options) {
  const int columns = swarm::columns_of(options);
  if (options.noise == Noise::none || columns == 3) return {};
  return fail(Error::Kind::invalid_option,
              fmt::format("noise is depth, must be none for {}: it is fitted to points of {} columns, and depth is the third of 3",
                          name(options.model), columns));
}

bool has_direction(ModelType type) { return type == ModelType::line2d || type == ModelType::plane || type == ModelType::cylinder; }

}  // namespace

std::vector<ModelType> FitOptions::kinds() const {
  std::vector<ModelType> all{model};
  all.insert(all.end(), rivals.begin(), rivals.end());
  return all;
}

Expected<> FitOptions::validate() const {
  Expected<> checks[] = {
      require(!threshold || positive(*threshold), "threshold", threshold.value_or(0), "finite and > 0"),
      // A float holds it, and what many points of it add up to.
      require(!threshold || (*threshold >= 1e-30 && *threshold <= 1e30), "threshold", threshold.value_or(0), "in [1e-30, 1e30]"),
      require(!particles || (*particles >= 2 && *particles <= 1'000'000), "particles", particles.value_or(0), "in [2, 1000000]"),
      require(!iterations || *iterations >= 1, "iterations", iterations.value_or(0), ">= 1"),
      require(!stall || *stall >= 1, "stall", stall.value_or(0), ">= 1"),
      require(!lambda || positive(*lambda), "lambda", lambda.value_or(0), "finite and > 0"),
      require(max_models <= 65534, "max_models", max_models, "<= 65534"),
      require(time_budget_ms >= 0 && std::isfinite(time_budget_ms), "time_budget_ms", time_budget_ms, "finite and >= 0 ms"),
      require(threads >= 0 && threads <= 4096, "threads", threads, "in [0, 4096]"),
      require(!backend.empty(), "backend", "''", "a name"),
  };
  for (Expected<>& check : checks) {
    if (!check) return std::move(check);
  }
  if (auto ok = check_own(*this); !ok) return ok;
  if (auto ok = check_rivals(*this); !ok) return ok;
  if (auto ok = check_noise(*this); !ok) return ok;
  if (!prior) return {};
  const std::vector<ModelType> all = kinds();
  if (std::none_of(all.begin(), all.end(), has_direction)) {
    return fail(Error::Kind::invalid_option, fmt::format("prior is given for a {}, must be for a line2d, plane or cylinder", name(model)));
  }
  return check_prior(*prior);
}

namespace swarm {
namespace {

Settings preset(Preset preset) {
  Settings s;
  if (preset == Preset::paper) {
    s.deflation = Deflation::parametric;
    s.refine = false;
    s.joint = false;
    s.patience = 1;
    return s;
  }
  s.iterations = 100;
  s.stall = 10;
  s.topology = Topology::ring;
  s.local_share = 0.5;
  s.still = 1e-3;
  s.search_points = 8192;
  s.fit_points = 16384;
  return s;
}

/// How many samples are scored when a swarm of `fast` begins, and how many of them fly on. Which model is found is settled by where
/// particles start, and many that are scored once cost no more than a few that fly. Figures: docs/fitting.md.
struct Crowd {
  int starters, particles;
};

Crowd crowd_of(ModelType type) {
  switch (type) {
    case ModelType::plane: return {512, 32};
    case ModelType::line2d: return {256, 16};
    case ModelType::circle2d: return {256, 32};
    case ModelType::sphere:
    case ModelType::cylinder: return {300, 75};
    case ModelType::homography: return {64, 64};  // four points hit one surface often enough; what they miss the joint end makes out
    case ModelType::fundamental: return {192, 32};
    case ModelType::own: return {100, 100};
  }
  return {100, 100};
}

/// What a kind asks of the search beyond the preset, where the preset is free to choose. Figures: docs/fitting.md.
Settings for_kind(Settings s, ModelType type) {
  if (!s.joint) return s;
  const Crowd crowd = crowd_of(type);
  s.starters = crowd.starters;
  s.particles = crowd.particles;
  if (type == ModelType::plane) return s;
  constexpr int kSoon = 5;  // still steps after which swarms of these kinds find no more
  if (type == ModelType::line2d || type == ModelType::circle2d) s.stall = kSoon;
  // Refinement brings the best of a swarm that has hardly flown to the same place, where what is looked for stands out.
  if (type == ModelType::line2d || type == ModelType::circle2d) s.eager_stall = 1;
  if (type == ModelType::line2d) {
    s.eager_starters = 64;
    return s;
  }
  // Few minimal samples of a curved model hit one surface, and flight alone seldom finds another basin: particles start anew all along.
  s.renewal_share = 0.5;
  s.patience = 3;
  if (dimension(type) < 4) return s;
  // In eight dimensions flight settles slowly; and points of one surface or body lie together in both images.
  s.renewal_share = 0.75;
  s.patience = 2;
  s.prices = type == ModelType::homography ? LabelPrices{0.15, 5.5} : LabelPrices{0.25, 5.5, 0.8, 0.5};
  if (type == ModelType::homography) {
    s.stall = 3;  // the joint end's swarms and samples of each model's own points go on from there
    return s;
  }
  // Seven points hit one body seldom: two searches that end sooner find more than one that takes its time.
  s.searches = 2;
  s.stall = 7;
  return s;
}

}  // namespace

int columns_of(const FitOptions& options) { return options.own ? options.own->dimension : dimension(options.model); }

Settings resolve(const FitOptions& options, std::size_t finite_points, double threshold) {
  Settings s = for_kind(preset(options.preset), options.model);
  if (s.joint && options.model == ModelType::plane && options.rivals.empty()) {
    // Planes have points enough to be seen among fewer; tools/plane_recall.py tells 16384 and these apart by no more than chance.
    s.search_points = 6144;
    s.fit_points = 8192;
  }
  s.iterations = options.iterations.value_or(s.iterations);
  // What converged on a part of the cloud is refined on more of it: the swarm need not settle there.
  // Such short swarms miss more, so one more of them may.
  constexpr int kStallOnPart = 5, kFlatStallOnPart = 2, kPatienceOnPart = 3;
  // Of a part fewer starters find as many planes, by tools/plane_recall.py.
  constexpr int kFlatStarters = 256;
  // And refinement brings it the rest of the way: a hundredth of the saving is for that.
  constexpr double kStillOnPart = 0.01;
  const bool on_part = s.searches_part(finite_points);
  if (on_part) {
    // Of several planes one that is missed is found next; who wants but one wants the best.
    const bool flat = options.model == ModelType::plane && options.max_models != 1;
    s.stall = flat ? kFlatStallOnPart : kStallOnPart;
    s.patience = kPatienceOnPart;
    s.still = kStillOnPart;
    if (flat) s.starters = kFlatStarters;
  }
  if (options.particles) {
    s.starters = s.particles = *options.particles;  // who asks for so many means all of them
    s.eager_starters = 0;
  }
  if (options.stall) {
    s.stall = *options.stall;
    s.eager_stall = 0;  // who asks for so many steps means all swarms
  }
  s.deflation = options.deflation.value_or(s.deflation);
  s.lambda = options.lambda.value_or(s.lambda);
  s.loss = options.loss.value_or(s.loss);
  s.threads = options.threads;
  s.threshold = threshold;
  const std::size_t fitted = s.fit_points > 0 ? std::min(s.fit_points, finite_points) : finite_points;
  s.stands_for = fitted > 0 ? static_cast<double>(finite_points) / static_cast<double>(fitted) : 1.0;
  // One point in a hundred, as CGAL's efficient RANSAC has it; never fewer than would be there by the sample itself.
  const std::size_t share = fitted / 100;
  const int sample = options.own ? options.own->minimal_sample : models::minimal_sample(options.model);
  const auto least = 2 * static_cast<std::size_t>(sample) + 1;
  const auto wanted = static_cast<std::size_t>(std::ceil(static_cast<double>(options.min_inliers) / s.stands_for));
  s.min_inliers = options.min_inliers > 0 ? wanted : std::max(share, least);
  return s;
}

}  // namespace swarm
}  // namespace swarmfit
