#include "host/swarm/contest.hpp"

#include <algorithm>
#include <utility>

#include "host/swarm/swarm.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::uint32_t kFirstContest = 1U << 31;  // rounds of contests, apart from those of the search
constexpr int kBriefStall = 1;                     // still steps that end a swarm on one model's points
constexpr int kChallengerRounds = 1;               // of its refinement on these: before it is compared it is refined as any candidate
constexpr double kGathered = 0.65;                 // share of a curved model's points that must gather about it
constexpr double kWellGathered = 0.8;              // the same: above, it is not asked against as many faces as a box has
constexpr double kAsGood = 0.95;                   // times what the faces of a box save: such a cylinder must save more
constexpr double kClearly = 1.1;                   // times what a flat model is worth: a curved one must be worth more

/// The caps of those points that a model explains; 0 elsewhere.
kernels::Reused<float> own_caps(std::span<const float> caps, std::span<const float> distances) {
  kernels::Reused<float> own(caps.size());
  for (std::size_t i = 0; i < caps.size(); ++i) own[i] = distances[i] < caps[i] ? caps[i] : 0.0F;
  return own;
}

}  // namespace

Expected<Outcome> Contest::hold(Candidate& winner) {
  if (worth_.lies_flat(winner)) return Outcome::found;
  if (auto done = challenge_by(0, problem_.asked, winner); !done) return tl::unexpected(done.error());
  if (pilot_.interrupted()) return Outcome::interrupted;
  if (problem_.flat_kind(winner.kind) == problem_.kinds.size()) return Outcome::found;
  models::Position flat;
  auto curved = bends(winner, flat);
  if (!curved) return tl::unexpected(curved.error());
  if (pilot_.interrupted()) return Outcome::interrupted;
  if (!*curved) return flatten(winner, std::move(flat));
  // What is round in another way than was asked for is not to be pieced together.
  if (auto done = challenge_by(problem_.asked, problem_.kinds.size(), winner); !done) return tl::unexpected(done.error());
  if (pilot_.interrupted()) return Outcome::interrupted;
  return problem_.kinds[winner.kind].hidden ? Outcome::flat : Outcome::found;
}

Expected<> Contest::challenge_by(std::size_t first, std::size_t last, Candidate& winner) {
  for (std::size_t kind = first; kind < last; ++kind) {
    if (kind == winner.kind || !is_curved(problem_.space(kind).type())) continue;
    Candidate challenger;
    challenger.kind = kind;
    auto there = challenge(winner, challenger);
    if (!there) return tl::unexpected(there.error());
    if (pilot_.interrupted()) return {};
    if (*there && worth_.of(challenger) > worth_.of(winner)) winner = std::move(challenger);
  }
  return {};
}

Expected<bool> Contest::best_on(std::size_t kind, std::span<const float> caps, models::Position& theta, std::vector<float>& distances) {
  const Pilot::Aside aside(pilot_);
  if (auto done = left_.show(caps); !done) return tl::unexpected(done.error());
  // Most of these points are of one model or of two: samples hit it at once, and refinement does the rest.
  Settings brief = problem_.kinds[kind].settings;
  brief.stall = std::min(brief.stall, kBriefStall);
  Swarm swarm(problem_.space(kind), brief, problem_.random);
  auto flown = pilot_.fly(swarm, kind, kFirstContest + contests_++, {}, caps, kUnexplained * problem_.tau);
  if (flown && *flown) {
    theta = swarm.best();
    const int rounds = is_curved(problem_.space(kind).type()) ? kChallengerRounds : kMostRounds;
    if (auto done = refine_one(problem_.whole(kind), problem_.settings.loss, caps, theta, rounds, &distances); !done) {
      return tl::unexpected(done.error());
    }
  }
  if (auto done = left_.show(); !done) return tl::unexpected(done.error());
  return flown;
}

Expected<bool> Contest::challenge(const Candidate& winner, Candidate& challenger) {
  auto there = best_on(challenger.kind, own_caps(left_.caps(), winner.distances), challenger.theta, challenger.distances);
  if (!there || !*there) return there;
  if (auto done = candidates_.refine(challenger); !done) return tl::unexpected(done.error());
  return candidates_.pays(challenger);
}

Expected<bool> Contest::bends(const Candidate& winner, models::Position& flat) {
  // A curved model along both sides of an edge is two flat ones; about a box it is as many as the box has faces along it.
  constexpr int kFlats = 2, kFaces = 4;
  const std::size_t kind = problem_.flat_kind(winner.kind);
  kernels::Reused<float> caps = own_caps(left_.caps(), winner.distances), distances(caps.size());
  const double bare = worth_.bare_saving(caps, winner.distances);
  const double own =
      worth_.of(bare * worth_.agreement(winner.kind, winner.theta, caps, winner.distances), problem_.space(winner.kind).freedom());
  const double share = worth_.gathered(winner);
  const bool strewn = share < kGathered || worth_.is_strewn(winner);
  // Normals near the edges of a thin box are those of a cylinder: there the distances alone decide.
  const bool cornered = !strewn && worth_.is_cornered(winner);
  const int asked = share < kWellGathered ? kFaces : kFlats, most = cornered ? kFaces : asked;
  double together = 0, bare_together = 0;
  for (int flats = 1; flats <= most; ++flats) {
    models::Position theta;
    auto there = best_on(kind, caps, theta, distances);
    if (!there) return there;
    if (!*there) return !strewn;
    if (flats == 1) flat = theta;
    if (strewn) return false;
    const double theirs_bare = worth_.bare_saving(caps, distances);
    together += theirs_bare * worth_.agreement(kind, theta, caps, distances);
    bare_together += theirs_bare;
    if (flats <= asked && own <= kClearly * worth_.of(together, flats * problem_.space(kind).freedom())) return false;
    if (cornered && bare <= kAsGood * bare_together) return false;
    take_nearer(distances, caps);
  }
  return true;
}

Expected<Outcome> Contest::look_flat(Candidate& best, Outcome otherwise) {
  // A curved model that lies in a plane may have no more points than its surroundings, and hold the swarms all the same; and samples of
  // what is flat determine none.
  if (otherwise == Outcome::unpaid && best.support.inliers() < problem_.settings.min_inliers) return otherwise;
  if (std::exchange(looked_flat_, true)) return otherwise;
  Candidate flat;
  flat.kind = problem_.kinds.size() - 1;
  auto outcome = Expected<Outcome>(Outcome::interrupted);
  {
    const Pilot::Aside aside(pilot_);
    outcome = search_.explore(kFirstContest + contests_++, {}, flat);
  }
  if (!outcome) return outcome;
  if (pilot_.interrupted()) return Outcome::interrupted;
  if (*outcome != Outcome::found) return otherwise;
  pilot_.go_on();
  best = std::move(flat);
  return Outcome::flat;
}

Expected<Outcome> Contest::flatten(Candidate& winner, models::Position flat) {
  winner.kind = problem_.flat_kind(winner.kind);
  if (flat.size() == 0) return Outcome::unpaid;
  winner.theta = std::move(flat);
  if (auto done = candidates_.refine(winner); !done) return tl::unexpected(done.error());
  if (!candidates_.pays(winner)) return Outcome::unpaid;
  return problem_.kinds[winner.kind].hidden ? Outcome::flat : Outcome::found;
}

Expected<> Contest::set_aside(const Candidate& candidate) {
  // It may lie across something small that is round, and only a box is known to be nothing else.
  constexpr float kHalf = 0.5F;
  const float kept = worth_.is_cornered(candidate) ? 0 : kHalf;
  for (std::size_t i = 0; i < left_.caps().size(); ++i) left_.caps()[i] *= candidate.distances[i] < left_.caps()[i] ? kept : 1.0F;
  return left_.show();
}

}  // namespace swarmfit::swarm
