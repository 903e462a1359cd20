#include "host/swarm/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::swarm {
namespace {

constexpr float kCorner = 0.1F;       // of tau: below this a residual weighs as in least squares, so that none weighs infinitely
constexpr double kWorthwhile = 1e-5;  // a fall of the loss below this share of it ends the rounds

Expected<> measure(const Ground& ground, const models::Position& theta, std::vector<float>& distances) {
  const Eigen::VectorXd data = ground.space.to_data(theta, ground.points.frame());
  distances.resize(ground.tau.size());
  const kernels::ModelView model{ground.space.kind(), std::span<const double>(data.data(), static_cast<std::size_t>(data.size()))};
  if (auto done = ground.evaluator.distances(model, distances); !done) return tl::unexpected(to_error(done.error()));
  return {};
}

/// Weights that turn least squares into least absolute deviations, which is what the truncated L1 loss asks of the points within tau.
void weights(const Ground& ground, std::span<const std::uint32_t> index, std::span<const float> distances, std::vector<double>& weight) {
  weight.resize(index.size());
  for (std::size_t k = 0; k < index.size(); ++k) {
    const float d = distances[index[k]], tau = ground.tau[index[k]];
    weight[k] = 1.0 / static_cast<double>(std::max(d / tau, kCorner));
  }
}

/// Sum over points of the distance to the nearest model, at most tau.
Expected<double> joint_energy(const Ground& ground, const std::vector<models::Position>& models) {
  std::vector<float> distances;
  std::vector<float> least(ground.tau.begin(), ground.tau.end());
  for (const models::Position& model : models) {
    if (auto done = measure(ground, model, distances); !done) return tl::unexpected(done.error());
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] < least[i]) least[i] = distances[i];
    }
  }
  double energy = 0;
  for (std::size_t i = 0; i < least.size(); ++i) energy += ground.points.finite(i) ? static_cast<double>(least[i]) : 0.0;
  return energy;
}

}  // namespace

Expected<> refine_one(const Ground& ground, Landscape& landscape, std::span<const float> caps, models::Position& theta, double& loss,
                      int rounds) {
  std::vector<float> distances;
  std::vector<std::uint32_t> index;
  std::vector<double> weight;
  for (int round = 0; round < rounds; ++round) {
    if (auto done = measure(ground, theta, distances); !done) return done;
    index.clear();
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] <= ground.tau[i] && distances[i] <= caps[i]) index.push_back(static_cast<std::uint32_t>(i));
    }
    weights(ground, index, distances, weight);
    if (!ground.index.empty()) {
      for (std::uint32_t& i : index) i = ground.index[i];
    }
    models::Position candidate = theta;
    if (!ground.space.refine(ground.points, {index, weight}, candidate)) return {};
    auto cost = landscape.loss(candidate);
    if (!cost) return tl::unexpected(cost.error());
    if (!(*cost < loss)) return {};
    const bool worthwhile = loss - *cost > kWorthwhile * loss;
    theta = candidate;
    loss = *cost;
    if (!worthwhile) return {};
  }
  return {};
}

Expected<double> refine_jointly(const Ground& ground, std::vector<models::Position>& models, int rounds) {
  std::vector<float> distances;
  std::vector<std::uint32_t> index;
  std::vector<double> weight;
  auto energy = joint_energy(ground, models);
  if (!energy) return energy;
  for (int round = 0; round < rounds; ++round) {
    std::vector<models::Position> candidates = models;
    for (std::size_t m = 0; m < models.size(); ++m) {
      if (auto done = measure(ground, models[m], distances); !done) return tl::unexpected(done.error());
      index.clear();
      for (std::size_t i = 0; i < distances.size(); ++i) {
        if (distances[i] <= ground.tau[i]) index.push_back(static_cast<std::uint32_t>(i));
      }
      weights(ground, index, distances, weight);
      if (!ground.space.refine(ground.points, {index, weight}, candidates[m])) candidates[m] = models[m];
    }
    auto candidate_energy = joint_energy(ground, candidates);
    if (!candidate_energy) return candidate_energy;
    if (!(*candidate_energy < *energy)) break;
    const bool worthwhile = *energy - *candidate_energy > kWorthwhile * *energy;
    models = std::move(candidates);
    energy = candidate_energy;
    if (!worthwhile) break;
  }
  return energy;
}

Expected<std::vector<std::size_t>> unique_support(const Ground& ground, const std::vector<models::Position>& models) {
  constexpr std::uint16_t kSeveral = 65535;
  std::vector<std::uint16_t> owner(ground.tau.size(), 0);
  std::vector<float> distances;
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (auto done = measure(ground, models[m], distances); !done) return tl::unexpected(done.error());
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (distances[i] <= ground.tau[i]) owner[i] = owner[i] == 0 ? static_cast<std::uint16_t>(m + 1) : kSeveral;
    }
  }
  std::vector<std::size_t> unique(models.size(), 0);
  for (const std::uint16_t m : owner) {
    if (m != 0 && m != kSeveral) ++unique[m - 1U];
  }
  return unique;
}

}  // namespace swarmfit::swarm
