#include "host/swarm/labelling.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "host/swarm/payment.hpp"
#include "kernels/point_tallies.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kUnit = 4096;            // whole units of energy a point: what graph cuts count in
constexpr float kFarthest = 2;            // tau: no point is owned from farther away
constexpr float kBeyond = 2 * kFarthest;  // tau, bent: of all that are farther away, for which it does not matter how far
constexpr int kAlternations = 10;         // of labels and models
constexpr int kFailures = 4;              // proposals in all that may be tried and not lower the energy before the rest is let be
constexpr double kPromising = 0.5;        // of a model's price that a proposal must save before it is fitted to its points
constexpr double kPaying = 1.2;           // and that it must save when it is, before points are labelled with it
constexpr double kTooDear = 0.6;          // and by which the energy with its labels may exceed the present one before models are refitted
constexpr double kLeastFall = 1e-3;       // of the energy that counts as one
constexpr double kHopeless = 0.5;         // of a model's price: what is dearer by that when refitted once is given up
constexpr double kCoherent = 0.5;         // share of neighbours alike, beyond chance, from which smoothness counts in full
constexpr int kCycles = 1;                // of expansions over all labels: the next fit brings the next
constexpr std::size_t kSmoothed = 6;      // nearest neighbours that a point would agree with

}  // namespace

std::uint64_t mark_of(std::span<const std::uint32_t> points) {
  std::uint64_t mark = 14695981039346656037U;
  for (const std::uint32_t i : points) mark = (mark ^ (i + 1ULL)) * 1099511628211U;
  return mark | 1;
}

Labelling::Labelling(const Ground& ground, const Subset& part, const models::Neighbours& neighbours, const LabelPrices& prices)
    : ground_(ground), part_(part), prices_(prices) {
  if (prices.bend > 0) {
    per_bend_ = std::log1p(1 / static_cast<float>(prices.bend));
    farthest_ = unbent(kFarthest * ground.tau) / ground.tau;
  }
  if (!(prices.smoothness > 0) || neighbours.empty()) return;
  kernels::Reused<std::pair<int, int>> asked;
  for (std::size_t i = 0; i < part.index().size(); ++i) {
    const auto near = neighbours.of(i);
    for (std::size_t k = 0; k < std::min(kSmoothed, near.size()); ++k) {
      const int one = static_cast<int>(i), other = static_cast<int>(near[k]);
      asked.emplace_back(std::min(one, other), std::max(one, other));
    }
  }
  std::sort(asked.begin(), asked.end());
  for (const auto& ends : asked) {
    if (edges_.empty() || edges_.back().first != ends) edges_.emplace_back(ends, 0);
    ++edges_.back().second;
  }
}

float Labelling::unbent(float cost) const {
  if (!(prices_.bend > 0)) return cost;
  const float bend = static_cast<float>(prices_.bend);
  return ground_.tau * bend * std::expm1(cost / ground_.tau * per_bend_);
}

Expected<Distances> Labelling::measure(std::span<const models::Position> models) const {
  ModelRows rows(ground_.points.frame(), models.size());
  for (const models::Position& theta : models) rows.add(ground_.space, theta);
  Distances distances(models.size(), part_.index().size());
  if (auto done = ground_.evaluator.weigh(part_.view(), {ground_.tau, 1, {}}, rows.views(), distances.all(), {}); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  if (prices_.bend > 0) kernels::bend(distances.all(), {ground_.tau, static_cast<float>(prices_.bend), farthest_, kBeyond});
  return distances;
}

void Labelling::label(State& state, std::span<const std::uint16_t> only) {
  using Cost = common::PottsEnergy::Cost;
  const std::size_t points = part_.index().size(), models = state.models.size();
  const bool new_edges = potts_smoothness_ != prices_.smoothness;
  if (new_edges) potts_ = {};
  common::PottsEnergy& potts = potts_;
  potts.forget_labels();
  potts.reserve(points, points * (models + 1), edges_.size());
  // Whole units, a point's one after the other; beyond reach where the point may not be the model's.
  constexpr auto kFree = static_cast<std::int32_t>(kUnit), kReach = static_cast<std::int32_t>(kUnit * kFarthest);
  kernels::Reused<std::int32_t> costs(points * models);
  const float per_tau = 1 / ground_.tau;
  for (std::size_t m = 0; m < models; ++m) {
    const std::span<const float> distances = std::as_const(state.distances)[m];
    for (std::size_t i = 0; i < points; ++i) {
      const float far = distances[i] * per_tau;
      costs[i * models + m] = far <= kFarthest ? static_cast<std::int32_t>(static_cast<float>(kUnit) * far) : kReach + 1;
    }
  }
  kernels::Reused<std::uint16_t> nearest(points, 0);
  for (std::size_t i = 0; i < points; ++i) {
    potts.add_node();
    potts.add_label(0, kFree);
    const std::uint16_t before = i < state.labels.size() ? state.labels[i] : std::uint16_t{0};
    std::int32_t least = kFree;
    bool may_stay = false;
    for (std::size_t m = 0; m < models; ++m) {
      const std::int32_t cost = costs[i * models + m];
      if (cost > kReach) continue;
      const auto label = static_cast<std::uint16_t>(m + 1);
      potts.add_label(label, cost);
      may_stay = may_stay || label == before;
      if (cost >= least) continue;
      least = cost;
      nearest[i] = label;
    }
    if (may_stay) nearest[i] = before;
  }
  // Gross outliers lie anywhere: a neighbour of theirs is not as odd as one that follows another model.
  potts.set_ground(0);
  for (const auto& [ends, count] : edges_) {
    if (!new_edges) break;
    potts.add_edge(ends.first, ends.second, count * 2 * static_cast<Cost>(kUnit * prices_.smoothness / 2));
  }
  potts_smoothness_ = prices_.smoothness;
  potts.close();
  // The newest model first: where labels are known already it is the one that changes them.
  kernels::Reused<std::uint16_t> order(models + 1);
  std::iota(order.rbegin(), order.rend(), std::uint16_t{0});
  if (!only.empty()) order.assign(only.begin(), only.end());
  state.labels = std::move(nearest);
  if (potts.edges() > 0) potts.minimise(order, kCycles, state.labels, 1);
  state.energy = static_cast<double>(potts.energy(state.labels)) / kUnit + prices_.model * static_cast<double>(models);
}

Expected<bool> Labelling::refit(State& state) {
  State next = state;
  kernels::Reused<std::uint32_t> own;
  kernels::Reused<std::size_t> moved;
  kernels::Reused<models::Position> to;
  for (std::size_t m = 0; m < state.models.size(); ++m) {
    own.clear();
    for (std::size_t i = 0; i < part_.index().size(); ++i) {
      if (state.labels[i] == m + 1) own.push_back(part_.index()[i]);
    }
    // For a model whose points are as they were nothing changes, once it has been fitted to them twice: one fit may end before it settles.
    const std::uint64_t twice = mark_of(own), once = twice - 1;
    if (next.fitted[m] == twice) continue;
    next.fitted[m] = next.fitted[m] == once ? twice : once;
    const kernels::Reused<double> weight(own.size(), 1.0);
    if (!ground_.space.refine(ground_.points, {own, weight}, next.models[m])) next.models[m] = state.models[m];
    moved.push_back(m);
    to.push_back(next.models[m]);
  }
  if (moved.empty()) return false;
  auto distances = measure(to);
  if (!distances) return tl::unexpected(distances.error());
  for (std::size_t k = 0; k < moved.size(); ++k) next.distances.set(moved[k], (*distances)[k]);
  label(next);
  if (!(next.energy < state.energy - kLeastFall)) return false;
  state = std::move(next);
  return true;
}

Expected<> Labelling::alternate(State& state, double hopeless) {
  for (int round = 0; round < kAlternations; ++round) {
    auto better = refit(state);
    if (!better) return tl::unexpected(better.error());
    if (!*better || state.energy > hopeless || enough_()) break;
  }
  return {};
}

void Labelling::remove(State& state, std::size_t model) {
  const auto at = static_cast<std::ptrdiff_t>(model);
  state.models.erase(state.models.begin() + at);
  state.distances.remove(model);
  state.fitted.erase(state.fitted.begin() + at);
  for (std::uint16_t& l : state.labels) {
    if (l == model + 1) l = 0;
    if (l > model + 1) --l;
  }
}

Expected<bool> Labelling::adopt(State&& with, double hopeless) {
  label(with);
  if (auto done = alternate(with, hopeless); !done) return tl::unexpected(done.error());
  if (!(with.energy < state_.energy - kLeastFall)) return false;
  state_ = std::move(with);
  return true;
}

Expected<bool> Labelling::adopt_one_more(State&& with, double at_once, std::optional<std::size_t> parent) {
  // What nobody owned is free again where the new model does not take it.
  kernels::Reused<std::uint16_t> changed{static_cast<std::uint16_t>(with.models.size())};
  if (parent) changed.push_back(static_cast<std::uint16_t>(*parent + 1));
  changed.push_back(0);
  label(with, changed);
  if (with.energy > state_.energy + at_once * prices_.model) return false;
  auto adopted = adopt(std::move(with), state_.energy + kHopeless * prices_.model);
  if (adopted && *adopted) kept_.push_back(kJoined);
  return adopted;
}

Expected<bool> Labelling::drop_one() {
  // The one that costs least to do without, judged before its neighbours adapt.
  State best;
  std::size_t worst = state_.models.size();
  for (std::size_t m = 0; m < state_.models.size(); ++m) {
    State without = state_;
    remove(without, m);
    label(without);
    if (worst == state_.models.size() || without.energy < best.energy) {
      best = std::move(without);
      worst = m;
    }
  }
  if (worst == state_.models.size()) return false;
  if (auto done = alternate(best); !done) return tl::unexpected(done.error());
  if (!(best.energy < state_.energy)) return false;
  state_ = std::move(best);
  kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(worst));
  return true;
}

Expected<> Labelling::drop() {
  for (;;) {
    auto dropped = drop_one();
    if (!dropped) return tl::unexpected(dropped.error());
    if (!*dropped) return {};
  }
}

double Labelling::cost(std::size_t point) const {
  const std::uint16_t label = state_.labels[point];
  return label == 0 ? 1.0 : static_cast<double>(state_.distances[label - 1U][point] / ground_.tau);
}

kernels::Reused<float> Labelling::present_costs() const {
  kernels::Reused<float> now(part_.index().size());
  for (std::size_t i = 0; i < now.size(); ++i) now[i] = static_cast<float>(cost(i)) * ground_.tau;
  return now;
}

void Labelling::costs(std::span<float> costs) const {
  std::fill(costs.begin(), costs.end(), 0.0F);
  for (std::size_t i = 0; i < part_.index().size(); ++i) {
    costs[part_.index()[i]] = unbent(static_cast<float>(std::min(1.0, cost(i))) * ground_.tau);
  }
}

Expected<bool> Labelling::try_one(models::Position proposal, std::span<const float> distances) {
  kernels::Reused<float> fitted(distances.begin(), distances.end());
  auto gain = fit_to_gain(proposal, fitted);
  if (!gain) return tl::unexpected(gain.error());
  if (*gain < kPaying * prices_.model) return false;
  State with = state_;
  with.models.push_back(std::move(proposal));
  with.distances.add(fitted);
  with.fitted.push_back(0);
  return adopt_one_more(std::move(with), kTooDear);
}

void Labelling::weigh_gains(Offers& offers) const {
  const kernels::Reused<float> now = present_costs();
  for (std::size_t p = 0; p < offers.gains.size(); ++p) {
    // What promises nothing now is not asked again.
    if (offers.gains[p] < kPromising * prices_.model) continue;
    offers.gains[p] = saved(now, offers.distances[p]) / static_cast<double>(ground_.tau);
  }
}

Expected<Labelling::Offers> Labelling::promising(std::span<const models::Position> proposals) const {
  constexpr std::size_t kAtOnce = 32;  // whose distances stay in a core's cache
  const kernels::Reused<float> now = present_costs();
  Offers offers;
  for (std::size_t first = 0; first < proposals.size(); first += kAtOnce) {
    const auto some = proposals.subspan(first, std::min(kAtOnce, proposals.size() - first));
    auto distances = measure(some);
    if (!distances) return tl::unexpected(distances.error());
    for (std::size_t k = 0; k < some.size(); ++k) {
      const double gain = saved(now, (*distances)[k]) / static_cast<double>(ground_.tau);
      if (!(gain > kPromising * prices_.model)) continue;
      offers.proposals.push_back(first + k);
      offers.gains.push_back(gain);
      offers.distances.add((*distances)[k]);
    }
  }
  return offers;
}

Expected<bool> Labelling::offer(std::span<const models::Position> proposals) {
  auto offers = promising(proposals);
  if (!offers) return tl::unexpected(offers.error());
  kernels::Reused<double>& gains = offers->gains;
  bool any = false;
  for (int failures = 0; failures < kFailures && !full() && !enough_();) {
    const auto best = std::max_element(gains.begin(), gains.end());
    if (best == gains.end() || !(*best > kPromising * prices_.model)) break;
    const auto p = static_cast<std::size_t>(best - gains.begin());
    gains[p] = 0;
    auto joined = try_one(proposals[offers->proposals[p]], offers->distances[p]);
    if (!joined) return tl::unexpected(joined.error());
    any = any || *joined;
    failures += *joined ? 0 : 1;
    if (*joined) weigh_gains(*offers);
  }
  return any;
}

Expected<> Labelling::start(std::span<const models::Position> models) {
  state_ = {};
  state_.models.assign(models.begin(), models.end());
  auto distances = measure(models);
  if (!distances) return tl::unexpected(distances.error());
  state_.distances = std::move(*distances);
  state_.fitted.assign(models.size(), 0);
  kept_.resize(models.size());
  std::iota(kept_.begin(), kept_.end(), std::size_t{0});
  const double wanted = std::exchange(prices_.smoothness, 0.0);
  label(state_);
  // Where models run through each other neighbours tell nothing, and agreement among them must not be asked for.
  const double together = std::min(1.0, coherence() / kCoherent);
  prices_.smoothness = wanted * together;
  prices_.model *= 1 + prices_.strewn * (1 - together);
  label(state_);
  return alternate(state_);
}

double Labelling::coherence() const {
  const std::size_t points = state_.labels.size();
  kernels::Reused<std::size_t> owned(state_.models.size() + 1, 0);
  for (const std::uint16_t l : state_.labels) ++owned[l];
  double alike = 0, by_chance = 0, asked = 0;
  for (const auto& [ends, count] : edges_) {
    const std::uint16_t one = state_.labels[static_cast<std::size_t>(ends.first)],
                        other = state_.labels[static_cast<std::size_t>(ends.second)];
    if (one == 0 && other == 0) continue;
    asked += count;
    alike += one == other ? count : 0;
    by_chance += count * static_cast<double>(owned[one == 0 ? other : one]) / static_cast<double>(points);
  }
  return asked > by_chance ? std::max(0.0, (alike - by_chance) / (asked - by_chance)) : 1.0;
}

void Labelling::write(std::span<std::uint16_t> labels) const {
  std::fill(labels.begin(), labels.end(), std::uint16_t{0});
  for (std::size_t i = 0; i < state_.labels.size(); ++i) labels[part_.index()[i]] = state_.labels[i];
}

}  // namespace swarmfit::swarm
