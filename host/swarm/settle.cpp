#include "host/swarm/settle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/swarm/efficiency.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

ModelRows rows_of(const Ground& ground, std::span<const models::Placed> models) {
  ModelRows rows(ground.points.frame(), models.size());
  for (const auto& [space, theta] : models) rows.add(*space, theta);
  return rows;
}

/// What the points that each model owns already say of it; its cost is of all points.
Expected<> weigh_own(const Ground& whole, std::span<const kernels::ModelView> models, std::span<const std::uint16_t> labels,
                     std::span<kernels::Evidence> evidence) {
  kernels::Reused<float> distances(labels.size() * models.size()), own(labels.size());
  if (auto done = whole.evaluator.weigh(whole.view(), {whole.tau, 1, {}}, models, distances, evidence); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  for (std::size_t m = 0; m < models.size(); ++m) {
    const double cost = evidence[m].cost;
    for (std::size_t i = 0; i < labels.size(); ++i) own[i] = labels[i] == m + 1 ? whole.allowed_at(i) : 0.0F;
    const auto done = whole.evaluator.weigh(whole.view(), whole.weighing(own, 1), models.subspan(m, 1), {}, evidence.subspan(m, 1));
    if (!done) return tl::unexpected(to_error(done.error()));
    // A label may reach beyond the threshold, where a point has no weight in the moments.
    evidence[m].cost = cost;
    evidence[m].count = 0;
    evidence[m].square = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (labels[i] != m + 1) continue;
      const auto d = static_cast<double>(distances[m * labels.size() + i]);
      ++evidence[m].count;
      evidence[m].square += d * d;
    }
  }
  return {};
}

/// Of a residual of one component, by what truncation hides of the noise and by what the estimate is less efficient than least squares.
double variance_factor(double tau, double corner, double rms) {
  if (!(rms > 0)) return 1;
  const double sigma = untruncated_deviation(rms, tau);
  return sigma * sigma / (rms * rms) * variance_beside_least_squares(corner * tau / sigma, tau / sigma);
}

/// In the working frame; from the points themselves where their moments do not tell it.
models::Covariance covariance(const Ground& whole, const kernels::Evidence& evidence, std::span<const std::uint16_t> labels,
                              std::size_t label, const models::Position& theta) {
  const double scale = whole.points.frame().scale, squares = evidence.square / (scale * scale);
  if (whole.space.closed_form()) {
    const double degrees = std::max(1.0, static_cast<double>(evidence.count) - whole.space.freedom());
    return squares / degrees * whole.space.covariance_by_moments(evidence.moments, whole.points.frame(), theta);
  }
  kernels::Reused<std::uint32_t> own;
  own.reserve(evidence.count);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == label) own.push_back(static_cast<std::uint32_t>(i));
  }
  const kernels::Reused<double> weight(own.size(), 1.0);
  const models::Weighted support{own, weight};
  return whole.space.noise_variance(whole.points, support, theta, squares) * whole.space.unit_covariance(whole.points, support, theta);
}

/// refit() of models that have no say in each other's points.
Expected<> refit_apart(const Ground& whole, std::vector<models::Placed>& found, std::span<const models::Placed> hidden) {
  kernels::Reused<models::Placed> all = found;
  all.insert(all.end(), hidden.begin(), hidden.end());
  const auto nearest = TwoNearest::of(whole, all);
  if (!nearest) return tl::unexpected(nearest.error());
  kernels::Reused<float> caps(whole.size()), own_distances(whole.size());
  for (std::size_t m = 0; m < found.size(); ++m) {
    nearest->left_by_others(whole, m, caps);
    const Ground own = whole.of(*found[m].space);
    const auto evidence = weigh(own, found[m].theta, caps, own_distances);
    if (!evidence) return tl::unexpected(evidence.error());
    models::Position candidate = found[m].theta;
    if (refine(own, *evidence, caps, own_distances, candidate)) found[m].theta = candidate;
  }
  return {};
}

}  // namespace

Expected<> refit(const Ground& whole, std::vector<models::Placed>& found, bool shared, std::span<const models::Placed> hidden) {
  if (shared) return refit_apart(whole, found, hidden);
  kernels::Reused<kernels::Evidence> evidence;
  if (std::all_of(found.begin(), found.end(), [](const models::Placed& model) { return model.space->closed_form(); })) {
    const ModelRows models = rows_of(whole, found);
    auto all = weigh_all(whole, models.views());
    if (!all) return tl::unexpected(all.error());
    evidence = std::move(*all);
  }
  kernels::Reused<float> distances(evidence.empty() ? whole.size() : 0);
  for (std::size_t m = 0; m < found.size(); ++m) {
    const Ground own = whole.of(*found[m].space);
    kernels::Evidence known;
    if (evidence.empty()) {
      const auto weighed = weigh(own, found[m].theta, {}, distances);
      if (!weighed) return tl::unexpected(weighed.error());
      known = *weighed;
    } else {
      known = evidence[m];
    }
    models::Position candidate = found[m].theta;
    if (refine(own, known, {}, distances, candidate)) found[m].theta = candidate;
  }
  return {};
}

Expected<> settle(const Ground& whole, const std::vector<models::Placed>& found, std::span<const models::Placed> hidden,
                  std::span<const float> corners, FitResult& result) {
  const models::Frame& frame = whole.points.frame();
  kernels::Reused<models::Placed> all = found;
  all.insert(all.end(), hidden.begin(), hidden.end());
  const ModelRows models = rows_of(whole, all);
  kernels::Reused<kernels::Evidence> evidence(all.size());
  if (result.labels.empty()) {
    result.labels.resize(whole.points.size());
    const std::span<const float> tolerance = whole.allowed.empty() ? std::span<const float>(&whole.tau, 1) : whole.allowed;
    if (auto done = whole.evaluator.claim(whole.view(), tolerance, models.views(), result.labels, evidence); !done) {
      return tl::unexpected(to_error(done.error()));
    }
    if (!hidden.empty()) forget_beyond(found.size(), result.labels);
  } else {
    evidence.resize(found.size());
    if (auto done = weigh_own(whole, models.views().first(found.size()), result.labels, evidence); !done) return done;
  }
  for (std::size_t m = 0; m < found.size(); ++m) {
    Model& model = result.models[m];
    const auto n = static_cast<double>(evidence[m].count);
    model.parameters = models.parameters(m);
    model.inliers = evidence[m].count;
    model.rms = n > 0 ? std::sqrt(evidence[m].square / n) : 0.0;
    const auto& [space, theta] = found[m];
    model.type = space->type();
    model.covariance = space->covariance_to_data(covariance(whole.of(*space), evidence[m], result.labels, m + 1, theta), theta, frame);
    // Where each point has a threshold of its own, one deviation for all would not tell what is cut off.
    if (space->residual_components() > 1 || !whole.allowed.empty()) continue;
    model.covariance *= variance_factor(static_cast<double>(whole.tau), static_cast<double>(corners[m]), model.rms);
  }
  return {};
}

}  // namespace swarmfit::swarm
