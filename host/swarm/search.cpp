#include "host/swarm/search.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "host/swarm/kinds.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;  // spread of the list of global bests, as a share of the scale, below which it is stable
constexpr int kTimesAsMany = 3;   // samples begin the swarm that follows one in vain
// Of them, on points: as many as a swarm may begin with for that.
constexpr std::size_t kScored = std::size_t{1} << 22, kScoredOnPart = std::size_t{1} << 24;

}  // namespace

Settings Search::settings_of(std::size_t kind) const {
  Settings settings = problem_.kinds[kind].settings;
  if (soon_ && settings.eager_stall > 0) {
    settings.stall = std::min(settings.stall, settings.eager_stall);
    if (settings.eager_starters > 0) settings.starters = std::min(settings.starters, settings.eager_starters);
    return settings;
  }
  // The joint end makes out what swarms of correspondences miss; on a part of a large cloud planes have points enough, and several kinds
  // are searched again anyway; and what tells the scale of the noise is prominent.
  const bool enough = problem_.part_searched && (problem_.asked > 1 || !is_curved(problem_.space(kind).type()));
  if (!settings.joint || problem_.shares_out() || enough || settings.starters <= settings.particles) return settings;
  const std::size_t points = std::max<std::size_t>(1, problem_.searched().size());
  const auto affordable = static_cast<int>((problem_.part_searched ? kScoredOnPart : kScored) / points);
  int more = settings.starters;
  for (int k = 0; k < vain_ && more < affordable; ++k) more *= kTimesAsMany;
  settings.starters = std::max(settings.starters, std::min(more, affordable));
  return settings;
}

Expected<bool> Search::look_beside(const Swarm& swarm, Candidate& candidate) const {
  if (!problem_.settings.refine || problem_.shares_out() || problem_.part_searched || problem_.kinds.size() > 1) return false;
  for (const std::size_t particle : swarm.best_of_stretches()) {
    Candidate other;
    other.kind = candidate.kind;
    other.theta = swarm.own_bests()[particle];
    other.saving = candidate.saving;
    if (auto done = candidates_.refine(other); !done) return tl::unexpected(done.error());
    if (2 * other.support.beside > other.support.inliers() || !candidates_.pays_among_others(other)) continue;
    candidate = std::move(other);
    return true;
  }
  return false;
}

Expected<Outcome> Search::explore(std::uint32_t round, std::span<const models::Position> seeds, Candidate& candidate) {
  const Settings settings = settings_of(candidate.kind);
  Swarm swarm(problem_.space(candidate.kind), settings, problem_.random);
  auto flown = pilot_.fly(swarm, candidate.kind, round, seeds, left_.caps(), kUnexplained * problem_.tau);
  if (!flown) return tl::unexpected(flown.error());
  if (!*flown) return Outcome::interrupted;
  candidate.theta = swarm.best();
  candidate.saving = swarm.saving();
  if (problem_.kinds.size() > 1 && problem_.points.has_normals()) {
    if (auto done = worth_.choose(swarm, candidate); !done) return tl::unexpected(done.error());
  }
  if (problem_.shares_out()) proposals_.insert(proposals_.end(), swarm.own_bests().begin(), swarm.own_bests().end());
  if (auto done = candidates_.refine(candidate); !done) return tl::unexpected(done.error());
  if (candidates_.pays(candidate)) return Outcome::found;
  auto beside = look_beside(swarm, candidate);
  if (!beside) return tl::unexpected(beside.error());
  if (*beside) return Outcome::found;
  const auto& list = swarm.global_bests();
  const bool stable = list.front().fitness - list.back().fitness < kStable * pilot_.scale();
  return problem_.settings.deflation == Deflation::parametric && stable ? Outcome::complete : Outcome::unpaid;
}

}  // namespace swarmfit::swarm
