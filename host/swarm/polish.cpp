// The joint end: each model refined on what the others leave it, what no longer pays dropped.
#include <algorithm>
#include <numeric>
#include <utility>

#include "host/swarm/local_labels.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/refinement.hpp"

namespace swarmfit::swarm {
namespace {

constexpr float kOwn = 2;           // tau: points farther from a model have no say in its last steps
constexpr float kTouched = 0.5F;    // tau: on its last steps a model runs through points no farther from where it was
constexpr std::size_t kStarts = 2;  // of exchanges: they may end in different places
constexpr int kExchanges = 30;      // of one of the points that a model runs through, at most

/// Places of the `count` smallest of the distances that are at most `tau`, smallest first, and then the rest of those in their order.
std::vector<std::uint32_t> nearest_first(std::span<const float> distances, float tau, std::size_t count) {
  std::vector<std::uint32_t> places;
  for (std::uint32_t i = 0; i < distances.size(); ++i) {
    if (distances[i] <= tau) places.push_back(i);
  }
  const auto middle = places.begin() + static_cast<std::ptrdiff_t>(std::min(count, places.size()));
  std::partial_sort(places.begin(), middle, places.end(), [&](std::uint32_t a, std::uint32_t b) {
    return distances[a] < distances[b] || (distances[a] == distances[b] && a < b);
  });
  return places;
}

}  // namespace

Expected<> MultiModel::conclude(const ModelCallback& on_model, FitResult& result, std::span<const models::Placed> others,
                                const kernels::Effort& effort) {
  effort_beside_ = effort;
  if (labelling_ != nullptr) return share_out(result, others, on_model);
  if (ends_jointly()) {
    if (auto done = polish(); !done) return done;
    // With many points the polished models are where the joint refit would leave them.
    if (!part_searched_) {
      if (auto energy = refine_jointly(ground_, found_); !energy) return tl::unexpected(energy.error());
    }
    if (auto done = drop_unpaid(result); !done) return done;
    tell_parameters(result);
    if (labels_locally()) {
      if (auto done = share_out_locally(); !done) return done;
    }
  }
  count_effort(result);
  return {};
}

void MultiModel::tell_parameters(FitResult& result) const {
  for (std::size_t m = 0; m < found_.size(); ++m) result.models[m].parameters = found_[m].space->to_data(found_[m].theta, points_.frame());
}

bool MultiModel::labels_locally() const noexcept { return settings_.sharpen && !part_searched_ && points_.finite_count() <= kFewPoints; }

Expected<> MultiModel::share_out_locally() {
  std::vector<models::Placed> all = found_;
  if (hidden_owns()) all.insert(all.end(), hidden_.begin(), hidden_.end());
  auto distances = measure(ground_, all);
  if (!distances) return tl::unexpected(distances.error());
  std::vector<float> room;
  for (std::vector<float>& one : *distances) {
    if (levelled(one, room).data() == room.data()) one.swap(room);
  }
  labels_ = label_locally(points_, *distances, tau_);
  forget_beyond(found_.size(), labels_);
  return {};
}

Expected<> MultiModel::drop_unpaid(FitResult& result) {
  while (found_.size() > 1) {
    auto unique = unique_support(ground_, found_);
    if (!unique) return tl::unexpected(unique.error());
    const auto least = std::min_element(unique->begin(), unique->end());
    if (2 * *least >= settings_.min_inliers) return {};
    found_.erase(found_.begin() + (least - unique->begin()));
    result.models.erase(result.models.begin() + (least - unique->begin()));
    if (auto energy = refine_jointly(ground_, found_, full_rounds()); !energy) return tl::unexpected(energy.error());
  }
  return {};
}

bool MultiModel::sharpens(const models::ModelSpace& of) const noexcept {
  const bool asked = settings_.joint && settings_.sharpen && !is_curved(of.type()) && settings_.loss == Loss::truncated_l1;
  const bool few = points_.finite_count() <= kFewPoints;
  return asked && few && !part_searched_ && !shares_out() && of.freedom() == of.minimal_sample();
}

float MultiModel::corner(const models::ModelSpace& of) const noexcept {
  if (shares_out()) return 1;
  return sharpens(of) ? 0 : ground_.corner;
}

Expected<> MultiModel::polish() {
  const std::vector<models::Placed> before = found_;
  if (auto done = polish_each(); !done) return done;
  return shares_out() || part_searched_ ? Expected<>() : keep_what_lowers(before);
}

Expected<> MultiModel::keep_what_lowers(const std::vector<models::Placed>& before) {
  // What is best for one model alone may cost another where they cross.
  auto least = joint_energy(ground_, before);
  const auto after = joint_energy(ground_, found_);
  if (!least) return tl::unexpected(least.error());
  if (!after) return tl::unexpected(after.error());
  if (!(*after > *least)) return {};
  std::vector<models::Placed> kept = before;
  for (std::size_t m = 0; m < kept.size(); ++m) {
    std::swap(kept[m], found_[m]);
    const auto now = joint_energy(ground_, kept);
    if (!now) return tl::unexpected(now.error());
    if (*now > *least) {
      std::swap(kept[m], found_[m]);
    } else {
      least = now;
    }
  }
  found_ = std::move(kept);
  return {};
}

Expected<> MultiModel::polish_at_once() {
  // The points are loaded once for all models.
  const auto weighed = [&](const std::vector<models::Placed>& models) {
    ModelRows rows(points_.frame(), models.size());
    for (const auto& [of, theta] : models) rows.add(*of, theta);
    return weigh_all(ground_, rows.views());
  };
  const auto before = weighed(found_);
  if (!before) return tl::unexpected(before.error());
  std::vector<models::Placed> refined = found_;
  for (std::size_t m = 0; m < found_.size(); ++m) {
    if (!swarm::refine(ground_.of(*found_[m].space), (*before)[m], {}, {}, refined[m].theta)) refined[m] = found_[m];
  }
  const auto after = weighed(refined);
  if (!after) return tl::unexpected(after.error());
  for (std::size_t m = 0; m < found_.size(); ++m) {
    if ((*after)[m].cost < (*before)[m].cost) found_[m] = refined[m];
  }
  return {};
}

Expected<> MultiModel::polish_each() {
  const bool simple = part_searched_ && !shares_points() && settings_.loss == Loss::truncated_l1;
  if (simple && std::all_of(found_.begin(), found_.end(), [](const models::Placed& model) { return model.space->closed_form(); })) {
    return polish_at_once();
  }
  // A model found late saw only what earlier ones had left; where two cross, the points there are both theirs. Not so among kinds: a ball
  // lies along the table that it lies on.
  restore_caps();
  std::vector<std::vector<float>> distances;
  if (shares_points()) {
    std::vector<models::Placed> all = found_;
    all.insert(all.end(), hidden_.begin(), hidden_.end());
    auto measured = measure(ground_, all);
    if (!measured) return tl::unexpected(measured.error());
    distances = std::move(*measured);
  }
  for (std::size_t m = 0; m < found_.size(); ++m) {
    const models::ModelSpace& of = *found_[m].space;
    if (!distances.empty()) left_by_others(ground_, distances, m, caps_);
    if (auto done = refine_one(ground_.of(of), settings_.loss, caps_, found_[m].theta, full_rounds()); !done) {
      return tl::unexpected(done.error());
    }
    if (!sharpens(of)) continue;
    if (auto done = run_through_points(found_[m]); !done) return done;
  }
  return {};
}

Expected<> MultiModel::run_through_points(models::Placed& model) {
  const models::ModelSpace& of = *model.space;
  const auto size = static_cast<std::size_t>(of.minimal_sample());
  const std::size_t kind = place_of(model, kinds_);
  std::vector<float> distances(points_.size());
  if (auto done = weigh(ground_.of(of), model.theta, caps_, distances); !done) return tl::unexpected(done.error());
  std::vector<float> room;
  const std::span<const float> level = levelled(distances, room);
  const std::vector<std::uint32_t> near = nearest_first(level, kTouched * tau_, kStarts * size);
  if (near.size() <= kStarts * size) return {};
  // Where two models cross, turning about their common point would lead from one to the other.
  std::vector<float> own = caps_;
  for (std::size_t i = 0; i < own.size(); ++i) own[i] = level[i] <= kOwn * tau_ ? own[i] : 0.0F;
  if (auto done = show(own); !done) return done;

  auto loss = landscapes_[kind].loss(model.theta);
  if (!loss) return tl::unexpected(loss.error());
  double least = *loss;
  models::Position end = model.theta;
  for (std::size_t start = 0; start < kStarts; ++start) {
    const auto first = near.begin() + static_cast<std::ptrdiff_t>(start * size);
    Exchange best{model.theta, {first, first + static_cast<std::ptrdiff_t>(size)}, *loss};
    std::size_t fruitless = 0;
    for (int exchange = 0; exchange < kExchanges && fruitless < size; ++exchange) {
      auto better = exchange_one(kind, near, static_cast<std::size_t>(exchange) % size, best);
      if (!better) return tl::unexpected(better.error());
      fruitless = *better ? 0 : fruitless + 1;
    }
    if (!(best.loss < least)) continue;
    least = best.loss;
    end = best.theta;
  }
  model.theta = end;
  return {};
}

Expected<bool> MultiModel::exchange_one(std::size_t kind, std::span<const std::uint32_t> candidates, std::size_t which, Exchange& best) {
  std::vector<models::Position> models;
  std::vector<std::uint32_t> points, sample = best.sample;
  for (const std::uint32_t point : candidates) {
    if (std::find(best.sample.begin(), best.sample.end(), point) != best.sample.end() && point != best.sample[which]) continue;
    sample[which] = point;
    models::Position theta;
    if (!space(kind).from_sample(points_, sample, theta)) continue;
    models.push_back(theta);
    points.push_back(point);
  }
  const auto at_once = static_cast<std::size_t>(settings_.particles);
  bool better = false;
  for (std::size_t first = 0; first < models.size(); first += at_once) {
    const auto some = std::span(models).subspan(first, std::min(at_once, models.size() - first));
    const std::vector<double> least(some.size(), best.loss);
    std::vector<double> losses(some.size());
    if (auto done = landscapes_[kind].fitness(some, least, losses); !done) return tl::unexpected(done.error());
    for (std::size_t k = 0; k < some.size(); ++k) {
      if (!(losses[k] < best.loss)) continue;
      best.loss = losses[k];
      best.theta = some[k];
      best.sample[which] = points[first + k];
      better = true;
    }
  }
  return better;
}

}  // namespace swarmfit::swarm
