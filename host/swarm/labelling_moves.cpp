// Moves of the joint end beyond labels and fits in turn: least squares stays in the basin that a swarm left it in, so each model is asked
// whether one through a few of its own points does better, whether it is two, and whether two are one.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "host/swarm/labelling.hpp"
#include "host/swarm/payment.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kTried = 2;       // proposals that are fitted, those that promise most
constexpr std::size_t kFitted = 128;    // points of a model that is fitted to be tried
constexpr int kFits = 2;                // of a proposal and what it wins, in turn
constexpr double kHint = 0.3;           // of a model's price that a proposal must save before a model is taken for two
constexpr double kWorthTrying = 0.75;   // of a model's price that the halves of a model must save before they are labelled
constexpr double kHalvesTooDear = 1.2;  // of a model's price by which the energy may be higher with them before they are refitted
constexpr double kWithinReach = 3;      // of what joining saves that a proposal may cost before it is fitted to the points of both

/// The places of the `count` largest, the largest first.
kernels::Reused<std::size_t> largest(std::span<const double> values, std::size_t count) {
  kernels::Reused<std::size_t> order(values.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), end, order.end(),
                    [&](std::size_t a, std::size_t b) { return values[a] != values[b] ? values[a] > values[b] : a < b; });
  order.erase(end, order.end());
  return order;
}

}  // namespace

kernels::Reused<std::uint32_t> Labelling::owned(std::size_t model) const {
  kernels::Reused<std::uint32_t> own;
  for (std::size_t i = 0; i < state_.labels.size(); ++i) {
    if (state_.labels[i] == model + 1) own.push_back(part_.index()[i]);
  }
  return own;
}

void Labelling::mark_owned(std::size_t model, std::span<float> marks) const {
  for (const std::uint32_t i : owned(model)) marks[i] = 1;
}

std::uint64_t Labelling::owned_set(std::size_t model) const { return mark_of(owned(model)); }

double Labelling::evenness(std::size_t model) const {
  constexpr std::size_t kMostComponents = 2;
  const std::size_t points = part_.index().size();
  kernels::Reused<std::array<double, kMostComponents>> residual(points, {0, 0});
  kernels::Reused<std::uint8_t> ours(points, 0);
  double square = 0, owned = 0;
  for (std::size_t i = 0; i < points; ++i) {
    if (state_.labels[i] != model + 1) continue;
    if (!ground_.space.residual(ground_.points, part_.index()[i], state_.models[model], residual[i])) continue;
    ours[i] = 1;
    ++owned;
    for (const double component : residual[i]) square += component * component;
  }
  double apart = 0, pairs = 0;
  for (const auto& [ends, count] : edges_) {
    const auto one = static_cast<std::size_t>(ends.first), other = static_cast<std::size_t>(ends.second);
    if (ours[one] == 0 || ours[other] == 0) continue;
    ++pairs;
    for (std::size_t c = 0; c < kMostComponents; ++c)
      apart += (residual[one][c] - residual[other][c]) * (residual[one][c] - residual[other][c]);
  }
  return pairs > 0 && square > 0 ? apart / pairs / (2 * square / owned) : 1.0;
}

double Labelling::border(std::size_t one, std::size_t other) const {
  const std::size_t a = one + 1, b = other + 1;
  double sum = 0;
  for (const auto& [ends, count] : edges_) {
    const std::size_t first = state_.labels[static_cast<std::size_t>(ends.first)],
                      second = state_.labels[static_cast<std::size_t>(ends.second)];
    if ((first == a && second == b) || (first == b && second == a)) sum += count * prices_.smoothness;
  }
  return sum;
}

template <class Takes>
void Labelling::fit_to(Takes&& takes, models::Position& theta) const {
  kernels::Reused<std::uint32_t> own;
  for (std::size_t i = 0; i < part_.index().size(); ++i) {
    if (takes(i)) own.push_back(part_.index()[i]);
  }
  const std::size_t fitted_to = std::min(own.size(), kFitted);
  for (std::size_t k = 0; k < fitted_to; ++k) own[k] = own[k * own.size() / fitted_to];
  own.resize(fitted_to);
  const kernels::Reused<double> weight(own.size(), 1.0);
  models::Position fitted = theta;
  if (ground_.space.refine(ground_.points, {own, weight}, fitted)) theta = std::move(fitted);
}

Expected<double> Labelling::fit_to_gain(models::Position& theta, kernels::Reused<float>& distances) const {
  const kernels::Reused<float> now = present_costs();
  double gain = saved(now, distances);
  for (int fit = 0; fit < kFits; ++fit) {
    models::Position next = theta;
    fit_to([&](std::size_t i) { return distances[i] < now[i]; }, next);
    auto measured = measure({&next, 1});
    if (!measured) return tl::unexpected(measured.error());
    const double better = saved(now, (*measured)[0]);
    if (!(better > gain)) break;
    gain = better;
    theta = std::move(next);
    distances.assign((*measured)[0].begin(), (*measured)[0].end());
  }
  return gain / static_cast<double>(ground_.tau);
}

Expected<bool> Labelling::replace(std::size_t model, std::span<const models::Position> proposals) {
  // What each point costs without this model.
  kernels::Reused<float> without(part_.index().size(), ground_.tau);
  for (std::size_t i = 0; i < without.size(); ++i) {
    const std::size_t l = state_.labels[i];
    if (l != 0 && l != model + 1) without[i] = std::min(ground_.tau, state_.distances[l - 1][i]);
  }
  kernels::Reused<models::Position> tried(proposals.begin(), proposals.end());
  Distances distances;
  kernels::Reused<double> gains;
  for (int fit = 0; fit <= kFits; ++fit) {
    auto measured = measure(tried);
    if (!measured) return tl::unexpected(measured.error());
    distances = std::move(*measured);
    gains.clear();
    for (std::size_t p = 0; p < tried.size(); ++p) gains.push_back(saved(without, distances[p]));
    if (fit == kFits) break;
    kernels::Reused<models::Position> next;
    for (const std::size_t p : largest(gains, kTried)) {
      fit_to([&](std::size_t i) { return distances[p][i] < without[i]; }, tried[p]);
      next.push_back(std::move(tried[p]));
    }
    tried = std::move(next);
  }
  const std::size_t p = largest(gains, 1).front();
  if (!(gains[p] > saved(without, state_.distances[model]))) return false;
  State with = state_;
  with.models[model] = tried[p];
  with.distances.set(model, distances[p]);
  with.fitted[model] = 0;
  return adopt(std::move(with));
}

Expected<bool> Labelling::split(std::size_t model, std::span<const models::Position> proposals) {
  if (full()) return false;
  const auto ours = [&](std::size_t i) { return state_.labels[i] == model + 1; };
  const std::size_t points = part_.index().size();
  kernels::Reused<float> now(points, 0);
  for (std::size_t i = 0; i < points; ++i) now[i] = ours(i) ? std::min(ground_.tau, state_.distances[model][i]) : 0.0F;
  auto measured = measure(proposals);
  if (!measured) return tl::unexpected(measured.error());
  kernels::Reused<double> gains;
  for (std::size_t p = 0; p < proposals.size(); ++p) gains.push_back(saved(now, (*measured)[p]));
  for (const std::size_t p : largest(gains, kTried)) {
    if (gains[p] < kHint * prices_.model * static_cast<double>(ground_.tau)) break;
    std::array<models::Position, 2> halves{state_.models[model], proposals[p]};
    Distances distances;
    distances.add(state_.distances[model]);
    distances.add((*measured)[p]);
    for (int fit = 0; fit < kFits; ++fit) {
      for (std::size_t k = 0; k < 2; ++k) {
        fit_to([&](std::size_t i) { return ours(i) && (k == 0 ? distances[0][i] <= distances[1][i] : distances[1][i] < distances[0][i]); },
               halves[k]);
      }
      auto again = measure(halves);
      if (!again) return tl::unexpected(again.error());
      distances = std::move(*again);
    }
    kernels::Reused<float> both(distances[0].begin(), distances[0].end());
    take_nearer(distances[1], both);
    if (!(saved(now, both) > kWorthTrying * prices_.model * static_cast<double>(ground_.tau))) continue;
    State with = state_;
    with.models[model] = halves[0];
    with.distances.set(model, distances[0]);
    with.fitted[model] = 0;
    with.models.push_back(halves[1]);
    with.distances.add(distances[1]);
    with.fitted.push_back(0);
    auto adopted = adopt_one_more(std::move(with), kHalvesTooDear, model);
    if (!adopted || *adopted) return adopted;
  }
  return false;
}

Expected<bool> Labelling::join(std::size_t one, std::size_t other, std::span<const models::Position> proposals) {
  const auto ours = [&](std::size_t i) { return state_.labels[i] == one + 1 || state_.labels[i] == other + 1; };
  const std::size_t points = part_.index().size();
  kernels::Reused<float> most(points, 0);
  double now = 0, all = 0;
  for (std::size_t i = 0; i < points; ++i) {
    if (!ours(i)) continue;
    most[i] = ground_.tau;
    now += cost(i);
    ++all;
  }
  auto measured = measure(proposals);
  if (!measured) return tl::unexpected(measured.error());
  kernels::Reused<double> gains;
  for (std::size_t p = 0; p < proposals.size(); ++p) gains.push_back(saved(most, (*measured)[p]));
  const std::size_t best = largest(gains, 1).front();
  const double saves = prices_.model + border(one, other), tau = static_cast<double>(ground_.tau);
  if (all - gains[best] / tau - now > kWithinReach * saves) return false;
  models::Position theta = proposals[best];
  kernels::Reused<float> distances((*measured)[best].begin(), (*measured)[best].end());
  for (int fit = 0; fit < kFits; ++fit) {
    fit_to([&](std::size_t i) { return ours(i) && distances[i] < ground_.tau; }, theta);
    auto again = measure({&theta, 1});
    if (!again) return tl::unexpected(again.error());
    distances.assign((*again)[0].begin(), (*again)[0].end());
  }
  if (all - saved(most, distances) / tau - now > saves) return false;
  State with = state_;
  for (std::uint16_t& l : with.labels) {
    if (l == other + 1) l = static_cast<std::uint16_t>(one + 1);
  }
  with.models[one] = std::move(theta);
  with.distances.set(one, distances);
  with.fitted[one] = 0;
  remove(with, other);
  auto adopted = adopt(std::move(with));
  if (adopted && *adopted) kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(other));
  return adopted;
}

Expected<> Labelling::contend(std::span<const models::Position> others) {
  if (others.empty() || (most_ > 0 && others.size() > most_)) return {};
  auto distances = measure(others);
  if (!distances) return tl::unexpected(distances.error());
  kernels::Reused<models::Position> beaten = state_.models;
  State with;
  with.models.assign(others.begin(), others.end());
  with.distances = std::move(*distances);
  with.fitted.assign(others.size(), 0);
  auto better = adopt(std::move(with));
  if (!better) return tl::unexpected(better.error());
  if (*better) {
    kept_.assign(state_.models.size(), kJoined);
  } else {
    beaten.assign(others.begin(), others.end());
  }
  if (beaten.empty()) return {};
  if (auto joined = offer(beaten); !joined) return tl::unexpected(joined.error());
  for (std::size_t m = 0; m < state_.models.size(); ++m) {
    if (auto replaced = replace(m, beaten); !replaced) return tl::unexpected(replaced.error());
  }
  return {};
}

}  // namespace swarmfit::swarm
