#include "host/swarm/labelling.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/perception/graph_cut.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kUnit = 4096;        // whole units of energy a point: what graph cuts count in
constexpr float kFarthest = 2;        // tau: no point is owned from farther away
constexpr int kAlternations = 10;     // of labels and models
constexpr int kFailures = 12;         // proposals in all that may join and not lower the energy before the rest is let be
constexpr double kPromising = 0.5;    // of a model's price that a proposal must save before it is fitted to its points
constexpr int kCycles = 3;            // of expansions over all labels
constexpr std::size_t kSmoothed = 6;  // nearest neighbours that a point would agree with

}  // namespace

Labelling::Labelling(const Ground& ground, const Subset& part, const models::Neighbours& neighbours, const LabelPrices& prices)
    : ground_(ground), part_(part), prices_(prices) {
  if (!(prices.smoothness > 0) || neighbours.empty()) return;
  for (std::size_t i = 0; i < part.index().size(); ++i) {
    const auto near = neighbours.of(i);
    for (std::size_t k = 0; k < std::min(kSmoothed, near.size()); ++k) edges_.emplace_back(static_cast<int>(i), static_cast<int>(near[k]));
  }
}

Expected<std::vector<std::vector<float>>> Labelling::measure(std::span<const models::Position> models) const {
  std::vector<Eigen::VectorXd> parameters;
  std::vector<kernels::ModelView> views;
  parameters.reserve(models.size());
  for (const models::Position& theta : models) {
    parameters.push_back(ground_.space.to_data(theta, ground_.points.frame()));
    const Eigen::VectorXd& row = parameters.back();
    views.push_back({ground_.space.kind(), std::span<const double>(row.data(), static_cast<std::size_t>(row.size()))});
  }
  const std::size_t points = part_.index().size();
  std::vector<float> all(points * models.size());
  std::vector<kernels::Evidence> evidence(models.size());
  if (auto done = ground_.evaluator.weigh(part_.view(), {ground_.tau, 1, {}}, views, all, evidence); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  std::vector<std::vector<float>> distances(models.size());
  for (std::size_t m = 0; m < models.size(); ++m) {
    distances[m].assign(all.begin() + static_cast<std::ptrdiff_t>(m * points), all.begin() + static_cast<std::ptrdiff_t>((m + 1) * points));
  }
  return distances;
}

void Labelling::label(State& state) const {
  perception::PottsEnergy potts;
  using Cost = perception::PottsEnergy::Cost;
  for (std::size_t i = 0; i < part_.index().size(); ++i) {
    potts.add_node();
    potts.add_label(0, static_cast<Cost>(kUnit));
    for (std::size_t m = 0; m < state.models.size(); ++m) {
      const float far = state.distances[m][i] / ground_.tau;
      if (!(far <= kFarthest)) continue;
      potts.add_label(static_cast<std::uint16_t>(m + 1), static_cast<Cost>(kUnit * static_cast<double>(far)));
    }
  }
  for (const auto& [i, j] : edges_) potts.add_edge(i, j, static_cast<Cost>(kUnit * prices_.smoothness));
  potts.close();
  std::vector<std::uint16_t> order(state.models.size() + 1);
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  state.labels = potts.cheapest();
  if (!edges_.empty()) potts.minimise(order, kCycles, state.labels);
  state.energy = static_cast<double>(potts.energy(state.labels)) / kUnit + prices_.model * static_cast<double>(state.models.size());
}

Expected<bool> Labelling::refit(State& state) const {
  State next = state;
  std::vector<std::uint32_t> own;
  for (std::size_t m = 0; m < state.models.size(); ++m) {
    own.clear();
    for (std::size_t i = 0; i < part_.index().size(); ++i) {
      if (state.labels[i] == m + 1) own.push_back(part_.index()[i]);
    }
    const std::vector<double> weight(own.size(), 1.0);
    if (!ground_.space.refine(ground_.points, {own, weight}, next.models[m])) next.models[m] = state.models[m];
  }
  auto distances = measure(next.models);
  if (!distances) return tl::unexpected(distances.error());
  next.distances = std::move(*distances);
  label(next);
  if (!(next.energy < state.energy - 1e-3)) return false;
  state = std::move(next);
  return true;
}

Expected<> Labelling::alternate(State& state) const {
  for (int round = 0; round < kAlternations; ++round) {
    auto better = refit(state);
    if (!better) return tl::unexpected(better.error());
    if (!*better) break;
  }
  return {};
}

Expected<bool> Labelling::drop_one(State& state) {
  // The one that costs least to do without, judged before its neighbours adapt.
  State best;
  std::size_t worst = state.models.size();
  for (std::size_t m = 0; m < state.models.size(); ++m) {
    State without = state;
    without.models.erase(without.models.begin() + static_cast<std::ptrdiff_t>(m));
    without.distances.erase(without.distances.begin() + static_cast<std::ptrdiff_t>(m));
    label(without);
    if (worst == state.models.size() || without.energy < best.energy) {
      best = std::move(without);
      worst = m;
    }
  }
  if (worst == state.models.size()) return false;
  if (auto done = alternate(best); !done) return tl::unexpected(done.error());
  if (!(best.energy < state.energy)) return false;
  state = std::move(best);
  kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(worst));
  return true;
}

std::vector<double> Labelling::costs(const State& state) const {
  std::vector<double> cost(part_.index().size(), 1.0);
  for (std::size_t i = 0; i < cost.size(); ++i) {
    if (state.labels[i] == 0) continue;
    const double far = static_cast<double>(state.distances[state.labels[i] - 1U][i] / ground_.tau);
    cost[i] = far;
  }
  return cost;
}

Expected<bool> Labelling::try_one(State& state, const models::Position& proposal, std::span<const float> distances) {
  State with = state;
  with.models.push_back(proposal);
  with.distances.emplace_back(distances.begin(), distances.end());
  label(with);
  if (auto done = alternate(with); !done) return tl::unexpected(done.error());
  if (!(with.energy < state.energy - 1e-3)) return false;
  state = std::move(with);
  kept_.push_back(kJoined);
  return true;
}

Expected<> Labelling::add(State& state, std::span<const models::Position> proposals) {
  auto measured = measure(proposals);
  if (!measured) return tl::unexpected(measured.error());
  const std::vector<std::vector<float>>& distances = *measured;
  std::vector<std::uint8_t> open(proposals.size(), 1);
  for (int failures = 0; failures < kFailures;) {
    const std::vector<double> cost = costs(state);
    std::size_t best = proposals.size();
    double most = kPromising * prices_.model;
    for (std::size_t p = 0; p < proposals.size(); ++p) {
      if (open[p] == 0) continue;
      double gain = 0;
      for (std::size_t i = 0; i < cost.size(); ++i) {
        const double far = static_cast<double>(distances[p][i] / ground_.tau);
        gain += std::max(0.0, cost[i] - far);  // NaN gains nothing
      }
      if (gain < kPromising * prices_.model) open[p] = 0;
      if (gain > most) {
        most = gain;
        best = p;
      }
    }
    if (best == proposals.size()) break;
    open[best] = 0;
    auto joined = try_one(state, proposals[best], distances[best]);
    if (!joined) return tl::unexpected(joined.error());
    failures += *joined ? 0 : 1;
  }
  return {};
}

Expected<> Labelling::settle(std::vector<models::Position>& models, std::span<const models::Position> proposals) {
  State state;
  state.models = models;
  auto distances = measure(models);
  if (!distances) return tl::unexpected(distances.error());
  state.distances = std::move(*distances);
  kept_.resize(models.size());
  std::iota(kept_.begin(), kept_.end(), std::size_t{0});
  label(state);

  if (auto done = alternate(state); !done) return done;

  if (auto done = add(state, proposals); !done) return done;

  for (;;) {
    auto dropped = drop_one(state);
    if (!dropped) return tl::unexpected(dropped.error());
    if (!*dropped) break;
  }
  models = std::move(state.models);
  labels_ = std::move(state.labels);
  energy_ = state.energy;
  return {};
}

void Labelling::write(std::span<std::uint16_t> labels) const {
  std::fill(labels.begin(), labels.end(), std::uint16_t{0});
  for (std::size_t i = 0; i < labels_.size(); ++i) labels[part_.index()[i]] = labels_[i];
}

}  // namespace swarmfit::swarm
