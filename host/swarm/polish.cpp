#include "host/swarm/polish.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "host/swarm/local_labels.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr float kOwn = 2;           // tau: points farther from a model have no say in its last steps
constexpr float kTouched = 0.5F;    // tau: on its last steps a model runs through points no farther from where it was
constexpr std::size_t kStarts = 2;  // of exchanges: they may end in different places
constexpr int kExchanges = 30;      // of one of the points that a model runs through, at most

/// Places of the `count` smallest of the distances that are at most `tau`, smallest first, and then the rest of those in their order.
kernels::Reused<std::uint32_t> nearest_first(std::span<const float> distances, float tau, std::size_t count) {
  kernels::Reused<std::uint32_t> places;
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

Expected<> Polish::refine(Models& found, std::span<const models::Placed> hidden) {
  const kernels::Reused<models::Placed> before = found;
  if (auto done = refine_each(found, hidden); !done) return done;
  return problem_.shares_out() || problem_.part_searched ? Expected<>() : keep_what_lowers(before, found);
}

Expected<> Polish::keep_what_lowers(const Models& before, Models& found) const {
  // What is best for one model alone may cost another where they cross.
  auto least = joint_energy(problem_.ground, before);
  const auto after = joint_energy(problem_.ground, found);
  if (!least) return tl::unexpected(least.error());
  if (!after) return tl::unexpected(after.error());
  if (!(*after > *least)) return {};
  kernels::Reused<models::Placed> kept = before;
  for (std::size_t m = 0; m < kept.size(); ++m) {
    std::swap(kept[m], found[m]);
    const auto now = joint_energy(problem_.ground, kept);
    if (!now) return tl::unexpected(now.error());
    if (*now > *least) {
      std::swap(kept[m], found[m]);
    } else {
      least = now;
    }
  }
  found = std::move(kept);
  return {};
}

Expected<> Polish::refine_at_once(Models& found) const {
  // The points are loaded once for all models.
  const auto weighed = [&](const std::vector<models::Placed>& models) {
    ModelRows rows(problem_.points.frame(), models.size());
    for (const auto& [of, theta] : models) rows.add(*of, theta);
    return weigh_all(problem_.ground, rows.views());
  };
  const auto before = weighed(found);
  if (!before) return tl::unexpected(before.error());
  kernels::Reused<models::Placed> refined = found;
  for (std::size_t m = 0; m < found.size(); ++m) {
    if (!swarm::refine(problem_.ground.of(*found[m].space), (*before)[m], {}, {}, refined[m].theta)) refined[m] = found[m];
  }
  const auto after = weighed(refined);
  if (!after) return tl::unexpected(after.error());
  for (std::size_t m = 0; m < found.size(); ++m) {
    if ((*after)[m].cost < (*before)[m].cost) found[m] = refined[m];
  }
  return {};
}

Expected<> Polish::refine_each(Models& found, std::span<const models::Placed> hidden) {
  const bool shared = problem_.shares_points(!hidden.empty());
  const bool simple = problem_.part_searched && !shared && problem_.settings.loss == Loss::truncated_l1;
  if (simple && std::all_of(found.begin(), found.end(), [](const models::Placed& model) { return model.space->closed_form(); })) {
    return refine_at_once(found);
  }
  // A model found late saw only what earlier ones had left; where two cross, the points there are both theirs. Not so among kinds: a ball
  // lies along the table that it lies on.
  left_.restore();
  std::optional<TwoNearest> nearest;
  if (shared) {
    kernels::Reused<models::Placed> all = found;
    all.insert(all.end(), hidden.begin(), hidden.end());
    auto measured = TwoNearest::of(problem_.ground, all);
    if (!measured) return tl::unexpected(measured.error());
    nearest = std::move(*measured);
  }
  for (std::size_t m = 0; m < found.size(); ++m) {
    const models::ModelSpace& of = *found[m].space;
    if (nearest) nearest->left_by_others(problem_.ground, m, left_.caps());
    if (auto done = refine_one(problem_.ground.of(of), problem_.settings.loss, left_.caps(), found[m].theta, problem_.full_rounds());
        !done) {
      return tl::unexpected(done.error());
    }
    if (!problem_.sharpens(of)) continue;
    if (auto done = run_through_points(found[m]); !done) return done;
  }
  return {};
}

Expected<> Polish::run_through_points(models::Placed& model) {
  const models::ModelSpace& of = *model.space;
  const auto size = static_cast<std::size_t>(of.minimal_sample());
  const std::size_t kind = place_of(model, problem_.kinds);
  kernels::Reused<float> distances(problem_.points.size());
  if (auto done = weigh(problem_.ground.of(of), model.theta, left_.caps(), distances); !done) return tl::unexpected(done.error());
  kernels::Reused<float> room;
  const std::span<const float> level = problem_.levelled(distances, room);
  const kernels::Reused<std::uint32_t> near = nearest_first(level, kTouched * problem_.tau, kStarts * size);
  if (near.size() <= kStarts * size) return {};
  // Where two models cross, turning about their common point would lead from one to the other.
  kernels::Reused<float> own = left_.caps();
  for (std::size_t i = 0; i < own.size(); ++i) own[i] = level[i] <= kOwn * problem_.tau ? own[i] : 0.0F;
  if (auto done = left_.show(own); !done) return done;

  auto loss = pilot_.landscape(kind).loss(model.theta);
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

Expected<bool> Polish::exchange_one(std::size_t kind, std::span<const std::uint32_t> candidates, std::size_t which, Exchange& best) {
  kernels::Reused<models::Position> models;
  kernels::Reused<std::uint32_t> points, sample = best.sample;
  for (const std::uint32_t point : candidates) {
    if (std::find(best.sample.begin(), best.sample.end(), point) != best.sample.end() && point != best.sample[which]) continue;
    sample[which] = point;
    models::Position theta;
    if (!problem_.space(kind).from_sample(problem_.points, sample, theta)) continue;
    models.push_back(theta);
    points.push_back(point);
  }
  const auto at_once = static_cast<std::size_t>(problem_.settings.starters);
  bool better = false;
  for (std::size_t first = 0; first < models.size(); first += at_once) {
    const auto some = std::span(models).subspan(first, std::min(at_once, models.size() - first));
    const kernels::Reused<double> least(some.size(), best.loss);
    kernels::Reused<double> losses(some.size());
    if (auto done = pilot_.landscape(kind).fitness(some, least, losses); !done) return tl::unexpected(done.error());
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

Expected<> Polish::drop_unpaid(Models& found, std::vector<Model>& models) const {
  while (found.size() > 1) {
    auto unique = unique_support(problem_.ground, found);
    if (!unique) return tl::unexpected(unique.error());
    const auto least = std::min_element(unique->begin(), unique->end());
    if (2 * *least >= problem_.settings.min_inliers) return {};
    found.erase(found.begin() + (least - unique->begin()));
    models.erase(models.begin() + (least - unique->begin()));
    if (auto energy = refine_jointly(problem_.ground, found, problem_.full_rounds()); !energy) return tl::unexpected(energy.error());
  }
  return {};
}

Expected<kernels::Reused<std::uint16_t>> Polish::label(std::span<const models::Placed> found,
                                                       std::span<const models::Placed> hidden) const {
  kernels::Reused<models::Placed> all(found.begin(), found.end());
  if (problem_.hidden_owns()) all.insert(all.end(), hidden.begin(), hidden.end());
  auto distances = measure(problem_.ground, all);
  if (!distances) return tl::unexpected(distances.error());
  kernels::Reused<float> room;
  for (std::vector<float>& one : *distances) {
    if (problem_.levelled(one, room).data() == room.data()) one.swap(room);
  }
  kernels::Reused<std::uint16_t> labels = label_locally(problem_.points, *distances, problem_.tau);
  forget_beyond(found.size(), labels);
  return labels;
}

}  // namespace swarmfit::swarm
