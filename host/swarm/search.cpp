#include "host/swarm/search.hpp"

#include <algorithm>

#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kStable = 0.01;  // spread of the list of global bests, as a share of the scale, below which it is stable

}  // namespace

Expected<Outcome> Search::explore(std::uint32_t round, std::span<const models::Position> seeds, Candidate& candidate) {
  Settings settings = problem_.kinds[candidate.kind].settings;
  if (soon_ && settings.eager_stall > 0) {
    settings.stall = std::min(settings.stall, settings.eager_stall);
    if (settings.eager_starters > 0) settings.starters = std::min(settings.starters, settings.eager_starters);
  }
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
  const auto& list = swarm.global_bests();
  const bool stable = list.front().fitness - list.back().fitness < kStable * pilot_.scale();
  return problem_.settings.deflation == Deflation::parametric && stable ? Outcome::complete : Outcome::unpaid;
}

}  // namespace swarmfit::swarm
