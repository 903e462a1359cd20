// How a candidate is judged: refined on all points, its support counted, and what it would leave of them.
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "host/swarm/deflation.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/split.hpp"

namespace swarmfit::swarm {
namespace {

constexpr int kFullRounds = 1;                      // of refinement on all points, where it was done on a part of them before
constexpr std::size_t kRun = std::size_t{1} << 18;  // points whose distances are in memory at a time

}  // namespace

bool MultiModel::lists_distances() const noexcept { return points_.size() <= 4 * kRun || kinds_.size() > 1 || !allowed_.empty(); }

template <class Visit>
Expected<> MultiModel::in_runs(const Candidate& candidate, Visit&& visit) const {
  if (lists_distances()) {
    visit(std::size_t{0}, std::span<const float>(candidate.distances));
    return {};
  }
  std::vector<float> distances;
  for (std::size_t first = 0; first < points_.size(); first += kRun) {
    distances.resize(std::min(kRun, points_.size() - first));
    if (auto done = tell_distances(whole(candidate.kind), candidate.theta, first, distances); !done) return done;
    visit(first, std::span<const float>(distances));
  }
  return {};
}

int MultiModel::full_rounds() const noexcept { return part_searched_ ? kFullRounds : kMostRounds; }

Expected<> MultiModel::refine(Candidate& candidate) {
  models::Position& theta = candidate.theta;
  if (part_searched_ && settings_.refine) {
    const Ground part = part_ground_.of(space(candidate.kind));
    if (auto done = refine_one(part, settings_.loss, part_caps_, theta, kMostRounds); !done) return tl::unexpected(done.error());
  }
  return look(candidate, settings_.refine ? full_rounds() : 0);
}

Expected<> MultiModel::look(Candidate& candidate, int rounds) {
  auto least =
      refine_one(whole(candidate.kind), settings_.loss, caps_, candidate.theta, rounds, lists_distances() ? &candidate.distances : nullptr);
  if (!least) return tl::unexpected(least.error());
  candidate.loss = *least;
  return count(candidate, caps_, near_);
}

Expected<> MultiModel::count(Candidate& candidate, std::span<const float> caps, const Near& near) const {
  candidate.support = {};
  std::vector<float> caps_room, room;
  return in_runs(candidate, [&](std::size_t first, std::span<const float> distances) {
    const std::span<const float> here = caps.subspan(first, distances.size());
    const std::span<const std::uint8_t> beside = std::span(near.beside).subspan(near.beside.empty() ? 0 : first);
    const bool shares = may_share(candidate.kind) && !near.nearest.empty();
    const std::span<const float> nearest = shares ? std::span(near.nearest).subspan(first, distances.size()) : std::span<const float>();
    candidate.support = count_support(levelled(distances, room), levelled(here, caps_room), tau_, beside, candidate.support, nearest);
  });
}

DeadZone MultiModel::dead_zone(const Candidate& candidate, std::span<const float> caps) const {
  DeadZone zone{tau_, allowed_, tail_reach(candidate.support), {}, settings_.dead_zone_slope};
  if (lists_distances() && zone.reach > 1 && space(candidate.kind).type() == ModelType::plane) {
    std::vector<float> room, caps_room;
    const std::span<const float> distances = levelled(candidate.distances, room);
    zone.reaches = local_reach(points_, candidate.theta.head<3>(), distances, levelled(caps, caps_room), tau_, zone.reach);
  }
  return zone;
}

Expected<> MultiModel::sink(const Candidate& candidate, std::vector<float>& caps, Near& near) const {
  near.beside.resize(points_.size());
  if (any_shares()) near.nearest.resize(points_.size(), std::numeric_limits<float>::infinity());
  const DeadZone zone = dead_zone(candidate, caps);
  return in_runs(candidate,
                 [&](std::size_t first, std::span<const float> distances) { swarm::deflate(distances, zone, first, caps, near); });
}

Expected<> MultiModel::deflate(const Candidate& candidate) {
  if (auto done = sink(candidate, caps_, near_); !done) return done;
  if (settings_.deflation == Deflation::parametric) return {};  // there the caps only tell what a model still explains
  return show(caps_);
}

Expected<> MultiModel::set_aside(const Candidate& candidate) {
  // It may lie across something small that is round, and only a box is known to be nothing else.
  constexpr float kHalf = 0.5F;
  const float kept = is_cornered(candidate) ? 0 : kHalf;
  for (std::size_t i = 0; i < caps_.size(); ++i) caps_[i] *= candidate.distances[i] < caps_[i] ? kept : 1.0F;
  return show(caps_);
}

Expected<std::optional<models::Position>> MultiModel::come_apart(Candidate& candidate) {
  const bool flat = kinds_.size() == 1 && space(0).type() == ModelType::plane && settings_.deflation == Deflation::residual;
  if (!flat || !part_searched_ || !settings_.refine || !allowed_.empty() || !looks_loose(candidate.support, settings_.threshold)) {
    return std::nullopt;
  }
  const Suspect suspect{candidate.theta, candidate.distances, caps_, settings_.min_inliers};
  const auto pair = crossing_pair(part_ground_, suspect, random_, splits_++);
  if (!pair) return tl::unexpected(pair.error());
  if (!*pair) return std::nullopt;
  std::array<Candidate, 2> halves;
  for (std::size_t k = 0; k < halves.size(); ++k) {
    halves[k].theta = (**pair)[k];
    if (auto done = look(halves[k], 0); !done) return tl::unexpected(done.error());
  }
  std::vector<float> both = halves[0].distances;
  take_nearer(halves[1].distances, both);
  if (!(saved(caps_, both) > saved(caps_, candidate.distances))) return std::nullopt;
  const std::size_t larger = halves[0].support.inliers() < halves[1].support.inliers() ? 1 : 0;
  Candidate &one = halves[larger], &other = halves[1 - larger];
  // Both must pay, the second by what the first leaves it.
  const int sample = space(0).minimal_sample();
  if (!pays(one.support, settings_, sample)) return std::nullopt;
  std::vector<float> caps = caps_;
  Near near = near_;
  if (auto done = sink(one, caps, near); !done) return tl::unexpected(done.error());
  if (auto done = count(other, caps, near); !done) return tl::unexpected(done.error());
  if (!pays(other.support, settings_, sample)) return std::nullopt;
  one.saving = candidate.saving;
  candidate = std::move(one);
  return std::move(other.theta);
}

}  // namespace swarmfit::swarm
