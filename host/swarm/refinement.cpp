#include "host/swarm/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/common/ranges.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kWorthwhile = 1e-5;  // a fall of the loss below this share of it ends the rounds

/// Does the refinement need to know each point's distance, beside what a pass tells?
bool needs_distances(const Ground& ground, Loss loss) { return !ground.space.closed_form() || loss != Loss::truncated_l1; }

double loss_of(const kernels::Evidence& evidence, Loss loss, std::span<const float> caps, std::span<const float> distances) {
  if (loss == Loss::truncated_l1) return evidence.cost;
  double sum = 0;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (std::isnan(distances[i])) continue;
    const auto least = static_cast<double>(std::min(distances[i], caps[i]));
    sum += least * least;
  }
  return sum;
}

}  // namespace

float widest_of(std::span<const float> allowed) noexcept {
  return allowed.empty() ? 0.0F : *std::max_element(allowed.begin(), allowed.end());
}

kernels::Weighing Ground::weighing(std::span<const float> caps, float corner_of_tau) const {
  if (allowed.empty()) return {tau, corner_of_tau, caps};
  // Caps tell who is near enough; the tolerance is beyond them all, and the corner stays where it is.
  return {widest, corner_of_tau * (tau / widest), caps.empty() ? allowed : caps};
}

ModelRows::ModelRows(const models::Frame& frame, std::size_t most) : frame_(frame) {
  parameters_.reserve(most);  // the views look into it
  views_.reserve(most);
}

void ModelRows::add(const models::ModelSpace& space, const models::Position& theta) {
  const models::Position& row = parameters_.emplace_back(space.to_data(theta, frame_));
  views_.push_back({space.kind(), std::span<const double>(row.data(), static_cast<std::size_t>(row.size()))});
}

void cap_all(const Ground& ground, std::vector<float>& caps) {
  caps.resize(ground.points.size());
  for (std::size_t i = 0; i < caps.size(); ++i) caps[i] = ground.points.finite(i) ? ground.allowed_at(i) : 0.0F;
}

void forget_beyond(std::size_t last, std::span<std::uint16_t> labels) noexcept {
  std::replace_if(
      labels.begin(), labels.end(), [&](std::uint16_t label) { return label > last; }, std::uint16_t{0});
}

void take_nearer(std::span<const float> distances, std::span<float> least) {
  for (std::size_t i = 0; i < least.size(); ++i) least[i] = distances[i] < least[i] ? distances[i] : least[i];
}

namespace {

Expected<kernels::Evidence> weigh_rows(const Ground& ground, const kernels::PointsView& rows, const kernels::Weighing& how,
                                       const models::Position& theta, std::span<float> distances) {
  const models::Position data = ground.space.to_data(theta, ground.points.frame());
  const kernels::ModelView model{ground.space.kind(), std::span<const double>(data.data(), static_cast<std::size_t>(data.size()))};
  kernels::Evidence evidence;
  const auto done = ground.evaluator.weigh(rows, how, std::span(&model, 1), distances, std::span(&evidence, 1));
  if (!done) return tl::unexpected(to_error(done.error()));
  return evidence;
}

}  // namespace

Expected<kernels::Evidence> weigh(const Ground& ground, const models::Position& theta, std::span<const float> caps,
                                  std::span<float> distances) {
  return weigh_rows(ground, ground.view(), ground.weighing(caps, ground.corner), theta, distances);
}

Expected<> tell_distances(const Ground& ground, const models::Position& theta, std::size_t first, std::span<float> distances) {
  const auto told = weigh_rows(ground, ground.view().rows(first, distances.size()), {ground.tau, ground.corner, {}}, theta, distances);
  return told ? Expected<>() : tl::unexpected(told.error());
}

Expected<kernels::Reused<kernels::Evidence>> weigh_all(const Ground& ground, std::span<const kernels::ModelView> models) {
  kernels::Reused<kernels::Evidence> evidence(models.size());
  if (auto done = ground.evaluator.weigh(ground.view(), ground.weighing({}, ground.corner), models, {}, evidence); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  return evidence;
}

bool refine(const Ground& ground, const kernels::Evidence& evidence, std::span<const float> caps, std::span<const float> distances,
            models::Position& theta) {
  if (evidence.count < static_cast<std::uint64_t>(ground.space.minimal_sample())) return false;
  if (ground.space.closed_form()) return ground.space.refine_by_moments(evidence.moments, ground.points.frame(), theta);
  kernels::Reused<std::uint32_t> index;
  kernels::Reused<double> weight;
  index.reserve(evidence.count);
  weight.reserve(evidence.count);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const float d = distances[i];
    if (!(d <= ground.allowed_at(i)) || (!caps.empty() && d > caps[i])) continue;
    index.push_back(ground.index(i));
    weight.push_back(1.0 / static_cast<double>(std::max(d / ground.tau, ground.corner)));
  }
  return ground.space.refine(ground.points, {index, weight}, theta);
}

Expected<double> refine_one(const Ground& ground, Loss loss, std::span<const float> caps, models::Position& theta, int rounds,
                            std::vector<float>* distances) {
  const bool listed = distances != nullptr || needs_distances(ground, loss);
  kernels::Reused<float> own, tried(listed && rounds > 0 ? ground.size() : 0);
  std::vector<float>& kept = distances != nullptr ? *distances : own;
  kept.resize(listed ? ground.size() : 0);
  auto evidence = weigh(ground, theta, caps, kept);
  if (!evidence) return tl::unexpected(evidence.error());
  double best = loss_of(*evidence, loss, caps, kept);
  for (int round = 0; round < rounds; ++round) {
    models::Position candidate = theta;
    if (!refine(ground, *evidence, caps, kept, candidate)) break;
    evidence = weigh(ground, candidate, caps, tried);
    if (!evidence) return tl::unexpected(evidence.error());
    const double now = loss_of(*evidence, loss, caps, tried);
    if (!(now < best)) break;
    const bool worthwhile = best - now > kWorthwhile * best;
    theta = candidate;
    best = now;
    kept.swap(tried);
    if (!worthwhile) break;
  }
  return best;
}

namespace {

/// Distances to the first model, then to the second, and so on; in one pass, for which the points are loaded once.
Expected<kernels::Reused<float>> measure_in_rows(const Ground& ground, std::span<const models::Placed> models) {
  ModelRows rows(ground.points.frame(), models.size());
  for (const auto& [space, theta] : models) rows.add(*space, theta);
  kernels::Reused<float> all(ground.size() * models.size());
  if (auto done = ground.evaluator.weigh(ground.view(), ground.weighing({}, ground.corner), rows.views(), all, {}); !done) {
    return tl::unexpected(to_error(done.error()));
  }
  return all;
}

}  // namespace

Expected<kernels::Reused<kernels::Reused<float>>> measure(const Ground& ground, std::span<const models::Placed> models) {
  const auto all = measure_in_rows(ground, models);
  if (!all) return tl::unexpected(all.error());
  const std::size_t points = ground.size();
  kernels::Reused<kernels::Reused<float>> distances(models.size());
  for (std::size_t m = 0; m < models.size(); ++m) {
    const auto first = all->begin() + static_cast<std::ptrdiff_t>(m * points);
    distances[m].assign(first, first + static_cast<std::ptrdiff_t>(points));
  }
  return distances;
}

Expected<double> joint_energy(const Ground& ground, std::span<const models::Placed> models) {
  auto distances = measure(ground, models);
  if (!distances) return tl::unexpected(distances.error());
  kernels::Reused<float> least(ground.size());
  for (std::size_t i = 0; i < least.size(); ++i) least[i] = ground.allowed_at(i);
  for (const std::vector<float>& one : *distances) take_nearer(one, least);
  double energy = 0;
  for (std::size_t i = 0; i < least.size(); ++i) energy += ground.points.finite(ground.index(i)) ? static_cast<double>(least[i]) : 0.0;
  return energy;
}

namespace {

/// Of points that take a nanosecond each.
template <class Some>
void in_ranges(const Ground& ground, std::size_t count, Some&& some) {
  constexpr std::size_t kRange = 16384;
  common::in_ranges(&ground.evaluator, count, kRange, kRange, some);
}

}  // namespace

Expected<TwoNearest> TwoNearest::of(const Ground& ground, std::span<const models::Placed> models) {
  TwoNearest two;
  two.nearest_.assign(ground.size(), std::numeric_limits<float>::infinity());
  two.next_ = two.nearest_;
  two.whose_.assign(ground.size(), 0);
  // Model by model: the distances to all of them at once are more than the caches hold.
  kernels::Reused<float> distances(ground.size());
  for (std::size_t m = 0; m < models.size(); ++m) {
    const Ground own = ground.of(*models[m].space);
    if (const auto told = weigh(own, models[m].theta, {}, distances); !told) return tl::unexpected(told.error());
    in_ranges(ground, distances.size(),
              [&](std::size_t first, std::size_t last) { two.meet(static_cast<std::uint32_t>(m), distances, first, last); });
  }
  return two;
}

void TwoNearest::meet(std::uint32_t model, std::span<const float> distances, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i) {
    const float d = distances[i], nearest = nearest_[i], next = next_[i];
    const bool closer = d < nearest;
    const float farther = closer ? nearest : d;
    next_[i] = farther < next ? farther : next;
    nearest_[i] = closer ? d : nearest;
    whose_[i] = closer ? model : whose_[i];
  }
}

void TwoNearest::left_by_others(const Ground& ground, std::size_t model, std::vector<float>& caps) const {
  in_ranges(ground, caps.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const float left = whose_[i] == model ? next_[i] : nearest_[i], allowed = ground.allowed_at(i);
      const float least = left < allowed ? left : allowed;
      caps[i] = ground.points.finite(ground.index(i)) ? least : 0.0F;
    }
  });
}

Expected<double> refine_jointly(const Ground& ground, std::vector<models::Placed>& models, int rounds) {
  kernels::Reused<float> distances;
  auto energy = joint_energy(ground, models);
  if (!energy) return energy;
  for (int round = 0; round < rounds; ++round) {
    kernels::Reused<models::Placed> candidates = models;
    for (std::size_t m = 0; m < models.size(); ++m) {
      const Ground own = ground.of(*models[m].space);
      distances.resize(needs_distances(own, Loss::truncated_l1) ? own.size() : 0);
      auto evidence = weigh(own, models[m].theta, {}, distances);
      if (!evidence) return tl::unexpected(evidence.error());
      if (!refine(own, *evidence, {}, distances, candidates[m].theta)) candidates[m] = models[m];
    }
    auto candidate_energy = joint_energy(ground, candidates);
    if (!candidate_energy) return candidate_energy;
    if (!(*candidate_energy < *energy)) break;
    const bool worthwhile = *energy - *candidate_energy > kWorthwhile * *energy;
    models.swap(candidates);
    energy = candidate_energy;
    if (!worthwhile) break;
  }
  return energy;
}

Expected<kernels::Reused<std::size_t>> unique_support(const Ground& ground, std::span<const models::Placed> models) {
  constexpr std::uint32_t kNobody = 0, kSeveral = ~std::uint32_t{0};
  const auto all = measure_in_rows(ground, models);
  if (!all) return tl::unexpected(all.error());
  const std::size_t points = ground.size();
  kernels::Reused<std::uint32_t> owner(points, kNobody);
  for (std::size_t m = 0; m < models.size(); ++m) {
    const float* const distances = all->data() + m * points;
    const auto mine = static_cast<std::uint32_t>(m + 1);
    const auto claim = [&](auto&& allowed) {
      for (std::size_t i = 0; i < points; ++i) {
        const std::uint32_t taken = owner[i] == kNobody ? mine : kSeveral;
        owner[i] = distances[i] <= allowed(i) ? taken : owner[i];
      }
    };
    if (ground.allowed.empty()) {
      claim([tau = ground.tau](std::size_t) { return tau; });
    } else {
      claim([&](std::size_t i) { return ground.allowed[i]; });
    }
  }
  kernels::Reused<std::size_t> unique(models.size(), 0);
  for (const std::uint32_t m : owner) {
    if (m != kNobody && m != kSeveral) ++unique[m - 1U];
  }
  return unique;
}

}  // namespace swarmfit::swarm
