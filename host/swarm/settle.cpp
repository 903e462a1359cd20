#include "host/swarm/settle.hpp"

#include <algorithm>
#include <cmath>

namespace swarmfit::swarm {
namespace {

/// Models as kernels take them.
class Views {
 public:
  Views(const Ground& ground, const std::vector<models::Position>& found) {
    parameters_.reserve(found.size());
    for (const models::Position& theta : found) {
      parameters_.push_back(ground.space.to_data(theta, ground.points.frame()));
      const models::Position& row = parameters_.back();
      views_.push_back({ground.space.kind(), std::span<const double>(row.data(), static_cast<std::size_t>(row.size()))});
    }
  }
  std::span<const kernels::ModelView> views() const noexcept { return views_; }
  const models::Position& parameters(std::size_t m) const noexcept { return parameters_[m]; }

 private:
  std::vector<models::Position> parameters_;
  std::vector<kernels::ModelView> views_;
};

/// Counts and squares of the points that each model owns already.
Expected<> weigh_own(const Ground& whole, std::span<const kernels::ModelView> models, std::span<const std::uint16_t> labels,
                     std::span<kernels::Evidence> evidence) {
  std::vector<float> distances(labels.size() * models.size());
  if (auto done = whole.evaluator.weigh(whole.view(), {whole.tau, 1, {}}, models, distances, evidence); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  for (std::size_t m = 0; m < models.size(); ++m) {
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

/// In the working frame; from the points themselves where their moments do not tell it.
Eigen::MatrixXd covariance(const Ground& whole, const kernels::Evidence& evidence, std::span<const std::uint16_t> labels, std::size_t label,
                           const models::Position& theta) {
  const double scale = whole.points.frame().scale, squares = evidence.square / (scale * scale);
  if (whole.space.closed_form()) {
    const double degrees = std::max(1.0, static_cast<double>(evidence.count) - whole.space.freedom());
    return squares / degrees * whole.space.covariance_by_moments(evidence.moments, whole.points.frame(), theta);
  }
  std::vector<std::uint32_t> own;
  own.reserve(evidence.count);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == label) own.push_back(static_cast<std::uint32_t>(i));
  }
  const std::vector<double> weight(own.size(), 1.0);
  const models::Weighted support{own, weight};
  return whole.space.noise_variance(whole.points, support, theta, squares) * whole.space.unit_covariance(whole.points, support, theta);
}

}  // namespace

Expected<> refit(const Ground& whole, std::vector<models::Position>& found) {
  std::vector<float> distances(whole.space.closed_form() ? 0 : whole.size());
  if (!distances.empty()) {
    for (models::Position& theta : found) {
      const auto evidence = weigh(whole, theta, {}, distances);
      if (!evidence) return tl::unexpected(evidence.error());
      models::Position candidate = theta;
      if (refine(whole, *evidence, {}, distances, candidate)) theta = candidate;
    }
    return {};
  }
  const Views models(whole, found);
  auto evidence = weigh_all(whole, models.views());
  if (!evidence) return tl::unexpected(evidence.error());
  for (std::size_t m = 0; m < found.size(); ++m) {
    models::Position candidate = found[m];
    if (refine(whole, (*evidence)[m], {}, {}, candidate)) found[m] = candidate;
  }
  return {};
}

Expected<> settle(const Ground& whole, const std::vector<models::Position>& found, FitResult& result) {
  const models::Frame& frame = whole.points.frame();
  const Views models(whole, found);
  std::vector<kernels::Evidence> evidence(found.size());
  if (result.labels.empty()) {
    result.labels.resize(whole.points.size());
    if (auto done = whole.evaluator.claim(whole.view(), whole.tau, models.views(), result.labels, evidence); !done) {
      return tl::unexpected(to_error(done.error()));
    }
  } else if (auto done = weigh_own(whole, models.views(), result.labels, evidence); !done) {
    return done;
  }
  for (std::size_t m = 0; m < found.size(); ++m) {
    Model& model = result.models[m];
    const auto n = static_cast<double>(evidence[m].count);
    model.parameters = models.parameters(m);
    model.inliers = evidence[m].count;
    model.rms = n > 0 ? std::sqrt(evidence[m].square / n) : 0.0;
    model.covariance = whole.space.covariance_to_data(covariance(whole, evidence[m], result.labels, m + 1, found[m]), found[m], frame);
  }
  return {};
}

}  // namespace swarmfit::swarm
