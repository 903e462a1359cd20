#include "host/swarm/candidates.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "host/swarm/kinds.hpp"
#include "host/swarm/split.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kRun = std::size_t{1} << 18;  // points whose distances are in memory at a time
constexpr double kSparse = 0.7;                     // of the density that points strewn evenly would have, at the sparsest
constexpr int kCurvedRounds = 4;                    // of refinement on a part: each takes Gauss-Newton steps, and one on all points follows

}  // namespace

template <class Visit>
Expected<> Candidates::in_runs(const Candidate& candidate, Visit&& visit) const {
  if (problem_.lists_distances()) {
    visit(std::size_t{0}, std::span<const float>(candidate.distances));
    return {};
  }
  kernels::Reused<float> distances;
  for (std::size_t first = 0; first < problem_.points.size(); first += kRun) {
    distances.resize(std::min(kRun, problem_.points.size() - first));
    if (auto done = tell_distances(problem_.whole(candidate.kind), candidate.theta, first, distances); !done) return done;
    visit(first, std::span<const float>(distances));
  }
  return {};
}

Expected<> Candidates::refine(Candidate& candidate) const {
  models::Position& theta = candidate.theta;
  if (problem_.part_searched && problem_.settings.refine) {
    const Ground part = problem_.part_ground.of(problem_.space(candidate.kind));
    const int rounds = is_curved(part.space.type()) ? kCurvedRounds : kMostRounds;
    if (auto done = refine_one(part, problem_.settings.loss, left_.part_caps(), theta, rounds); !done) return tl::unexpected(done.error());
  }
  return look(candidate, problem_.settings.refine ? problem_.full_rounds() : 0);
}

Expected<> Candidates::look(Candidate& candidate, int rounds) const {
  auto least = refine_one(problem_.whole(candidate.kind), problem_.settings.loss, left_.caps(), candidate.theta, rounds,
                          problem_.lists_distances() ? &candidate.distances : nullptr);
  if (!least) return tl::unexpected(least.error());
  candidate.loss = *least;
  return count(candidate, left_.caps(), left_.near());
}

Expected<> Candidates::count(Candidate& candidate, std::span<const float> caps, const Near& near) const {
  candidate.support = {};
  kernels::Reused<float> caps_room, room;
  return in_runs(candidate, [&](std::size_t first, std::span<const float> distances) {
    const std::span<const float> here = caps.subspan(first, distances.size());
    const std::span<const std::uint8_t> beside = std::span(near.beside).subspan(near.beside.empty() ? 0 : first);
    const bool shares = problem_.may_share(candidate.kind) && !near.nearest.empty();
    const std::span<const float> nearest = shares ? std::span(near.nearest).subspan(first, distances.size()) : std::span<const float>();
    candidate.support = count_support(problem_.levelled(distances, room), problem_.levelled(here, caps_room), problem_.tau, beside,
                                      candidate.support, nearest);
  });
}

DeadZone Candidates::dead_zone(const Candidate& candidate, std::span<const float> caps) const {
  DeadZone zone{problem_.tau, problem_.allowed, tail_reach(candidate.support), {}, problem_.settings.dead_zone_slope};
  if (problem_.lists_distances() && zone.reach > 1 && problem_.space(candidate.kind).type() == ModelType::plane) {
    kernels::Reused<float> room, caps_room;
    const std::span<const float> distances = problem_.levelled(candidate.distances, room);
    zone.reaches =
        local_reach(problem_.points, candidate.theta.head<3>(), distances, problem_.levelled(caps, caps_room), problem_.tau, zone.reach);
  }
  return zone;
}

Expected<> Candidates::sink(const Candidate& candidate, std::vector<float>& caps, Near& near) const {
  near.beside.resize(problem_.points.size());
  if (problem_.any_shares()) near.nearest.resize(problem_.points.size(), std::numeric_limits<float>::infinity());
  const DeadZone zone = dead_zone(candidate, caps);
  return in_runs(candidate,
                 [&](std::size_t first, std::span<const float> distances) { swarm::deflate(distances, zone, first, caps, near); });
}

bool Candidates::pays(const Candidate& candidate) const {
  const Settings& settings = problem_.kinds[candidate.kind].settings;
  const int sample = problem_.space(candidate.kind).minimal_sample();
  const double by_chance = strewn(candidate);
  if (swarm::pays(candidate.support, settings, sample, by_chance)) return true;
  // Few points in the plane, where all lines cross: there what others have taken decides.
  const bool crossed = problem_.points.dimension() == 2 && !problem_.part_searched && problem_.allowed.empty() && settings.refine &&
                       settings.deflation == Deflation::residual && !left_.near().beside.empty();
  if (!crossed) return false;
  kernels::Reused<float> caps;
  cap_all(problem_.ground, caps);
  return pays_across(candidate.support, count_support(candidate.distances, caps, problem_.tau), settings, sample, by_chance);
}

bool Candidates::pays_among_others(const Candidate& candidate) const {
  return swarm::pays_among_others(candidate.support, problem_.kinds[candidate.kind].settings,
                                  problem_.space(candidate.kind).minimal_sample(), strewn(candidate));
}

double Candidates::strewn(const Candidate& candidate) const {
  return problem_.settings.refine ? kSparse * problem_.strewn_along(candidate.kind, candidate.theta) : 0.0;
}

Expected<> Candidates::deflate(const Candidate& candidate) const {
  if (auto done = sink(candidate, left_.caps(), left_.near()); !done) return done;
  if (problem_.settings.deflation == Deflation::parametric) return {};  // there the caps only tell what a model still explains
  return left_.show();
}

Expected<std::optional<models::Position>> Candidates::come_apart(Candidate& candidate) {
  const bool flat =
      problem_.kinds.size() == 1 && problem_.space(0).type() == ModelType::plane && problem_.settings.deflation == Deflation::residual;
  if (!flat || !problem_.part_searched || !problem_.settings.refine || !problem_.allowed.empty() ||
      !looks_loose(candidate.support, problem_.settings.threshold)) {
    return std::nullopt;
  }
  const Suspect suspect{candidate.theta, candidate.distances, left_.caps(), problem_.settings.min_inliers};
  const auto pair = crossing_pair(problem_.part_ground, suspect, problem_.random, splits_++);
  if (!pair) return tl::unexpected(pair.error());
  if (!*pair) return std::nullopt;
  std::array<Candidate, 2> halves;
  for (std::size_t k = 0; k < halves.size(); ++k) {
    halves[k].theta = (**pair)[k];
    if (auto done = look(halves[k], 0); !done) return tl::unexpected(done.error());
  }
  kernels::Reused<float> both = halves[0].distances;
  take_nearer(halves[1].distances, both);
  if (!(saved(left_.caps(), both) > saved(left_.caps(), candidate.distances))) return std::nullopt;
  const std::size_t larger = halves[0].support.inliers() < halves[1].support.inliers() ? 1 : 0;
  Candidate &one = halves[larger], &other = halves[1 - larger];
  // Both must pay, the second by what the first leaves it.
  if (!pays(one)) return std::nullopt;
  kernels::Reused<float> caps = left_.caps();
  Near near = left_.near();
  if (auto done = sink(one, caps, near); !done) return tl::unexpected(done.error());
  if (auto done = count(other, caps, near); !done) return tl::unexpected(done.error());
  if (!pays(other)) return std::nullopt;
  one.saving = candidate.saving;
  candidate = std::move(one);
  return std::move(other.theta);
}

}  // namespace swarmfit::swarm
