// Between kinds: who wins a round, and what a curved winner must show for itself.
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/swarm/multi_model.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::uint32_t kFirstContest = 1U << 31;  // rounds of contests, apart from those of the search
constexpr double kAlong = 0.8;                     // cosine of the angle between a point's normal and the model's
constexpr int kBriefStall = 1;                     // still steps that end a swarm on one model's points
constexpr double kGathered = 0.65;                 // share of a curved model's points that must gather about it
constexpr double kWellGathered = 0.8;              // the same: above, it is not asked against as many faces as a box has
constexpr double kClearly = 1.1;                   // times what a flat model is worth: a curved one must be worth more

/// The caps of those points that a model explains; 0 elsewhere.
std::vector<float> own_caps(std::span<const float> caps, std::span<const float> distances) {
  std::vector<float> own(caps.size());
  for (std::size_t i = 0; i < caps.size(); ++i) own[i] = distances[i] < caps[i] ? caps[i] : 0.0F;
  return own;
}

}  // namespace

double MultiModel::worth(double saved, int freedom) const {
  // A parameter costs what it takes to write it down, half the logarithm of the number of points (Schwarz 1978), in points explained.
  const double price = 0.5 * std::log(static_cast<double>(points_.finite_count()));
  return saved / settings_.threshold - price * freedom;
}

double MultiModel::worth(const Candidate& candidate) const {
  return worth(saving(candidate.kind, candidate.theta, caps_, candidate.distances), space(candidate.kind).freedom());
}

double MultiModel::agreement(std::size_t kind, const models::Position& theta, std::span<const float> caps,
                             std::span<const float> distances) const {
  if (!points_.has_normals()) return 1;
  double all = 1, along = 1;
  for (const std::uint32_t i : part_.index()) {
    if (!(distances[i] < caps[i])) continue;
    const Eigen::Vector3d normal = points_.normal(i), outward = space(kind).outward(theta, points_.point<3>(i));
    if (normal.isZero()) continue;
    ++all;
    if (std::abs(normal.dot(outward)) >= kAlong * outward.norm()) ++along;
  }
  return along / all;
}

double MultiModel::gathered(const Candidate& candidate) const {
  // Points of a surface gather about it; those of faces that it happens to cross are strewn over its slab, at any angle to it.
  // In the plane nothing but the distance tells, and outliers fill the slab of a true circle as well.
  if (points_.dimension() != 3) return 1;
  const float half = 0.5F * tau_;
  double all = 0, inner = 0;
  std::vector<float> room;
  const std::span<const float> distances = levelled(candidate.distances, room);
  for (const std::uint32_t i : part_.index()) {
    if (!(candidate.distances[i] < caps_[i])) continue;
    ++all;
    inner += distances[i] < half ? 1 : 0;
  }
  return inner / std::max(1.0, all) * agreement(candidate.kind, candidate.theta, caps_, candidate.distances);
}

double MultiModel::saving(std::size_t kind, const models::Position& theta, std::span<const float> caps,
                          std::span<const float> distances) const {
  std::vector<float> caps_room, room;
  return saved(levelled(caps, caps_room), levelled(distances, room)) * agreement(kind, theta, caps, distances);
}

std::size_t MultiModel::flat_kind(std::size_t curved) const noexcept {
  if (!is_curved(space(curved).type())) return kinds_.size();
  if (kinds_.back().hidden) return kinds_.size() - 1;
  const ModelType flat = flat_of(space(curved).type());
  const auto at = std::find_if(kinds_.begin(), kinds_.end(), [&](const Kind& kind) { return kind.space->type() == flat; });
  return static_cast<std::size_t>(at - kinds_.begin());
}

Expected<MultiModel::Outcome> MultiModel::contest(Candidate& winner) {
  for (std::size_t kind = 0; kind < asked_; ++kind) {
    if (kind == winner.kind || !is_curved(space(kind).type())) continue;
    Candidate challenger;
    challenger.kind = kind;
    auto there = challenge(winner, challenger);
    if (!there) return tl::unexpected(there.error());
    if (interrupted()) return Outcome::interrupted;
    if (*there && worth(challenger) > worth(winner)) winner = std::move(challenger);
  }
  if (flat_kind(winner.kind) == kinds_.size()) return Outcome::found;
  models::Position flat;
  auto curved = bends(winner, flat);
  if (!curved) return tl::unexpected(curved.error());
  if (interrupted()) return Outcome::interrupted;
  return *curved ? Outcome::found : flatten(winner, std::move(flat));
}

Expected<bool> MultiModel::best_on(std::size_t kind, std::span<const float> caps, models::Position& theta, std::vector<float>& distances) {
  const std::size_t steps = steps_;
  if (auto done = show(caps); !done) return tl::unexpected(done.error());
  // Most of these points are of one model or of two: samples hit it at once, and refinement does the rest.
  Settings brief = kinds_[kind].settings;
  brief.stall = std::min(brief.stall, kBriefStall);
  Swarm swarm(space(kind), brief, random_);
  auto flown = fly(swarm, kind, kFirstContest + contests_++, {}, caps, kUnexplained * tau_);
  if (flown && *flown) {
    theta = swarm.best();
    if (auto done = refine_one(whole(kind), settings_.loss, caps, theta, kMostRounds, &distances); !done) {
      return tl::unexpected(done.error());
    }
  }
  if (!interrupted()) stop_reason_.clear();
  steps_ = steps;
  if (auto done = show(caps_); !done) return tl::unexpected(done.error());
  return flown;
}

Expected<bool> MultiModel::challenge(const Candidate& winner, Candidate& challenger) {
  auto there = best_on(challenger.kind, own_caps(caps_, winner.distances), challenger.theta, challenger.distances);
  if (!there || !*there) return there;
  if (auto done = refine(challenger); !done) return tl::unexpected(done.error());
  return pays(challenger.support, kinds_[challenger.kind].settings, space(challenger.kind).minimal_sample());
}

Expected<bool> MultiModel::bends(const Candidate& winner, models::Position& flat) {
  // A curved model along both sides of an edge is two flat ones; about a box it is as many as the box has faces along it.
  constexpr int kFlats = 2, kFaces = 4;
  const std::size_t kind = flat_kind(winner.kind);
  std::vector<float> caps = own_caps(caps_, winner.distances), distances(caps.size());
  const double own = worth(saving(winner.kind, winner.theta, caps, winner.distances), space(winner.kind).freedom());
  const double share = gathered(winner);
  const bool loose = share < kGathered;
  const int most = share < kWellGathered ? kFaces : kFlats;
  double together = 0;
  for (int flats = 1; flats <= most; ++flats) {
    models::Position theta;
    auto there = best_on(kind, caps, theta, distances);
    if (!there) return there;
    if (!*there) return !loose;
    if (flats == 1) flat = theta;
    if (loose) return false;
    together += saving(kind, theta, caps, distances);
    const double theirs = worth(together, flats * space(kind).freedom());
    if (own <= kClearly * theirs) return false;
    take_nearer(distances, caps);
  }
  return true;
}

Expected<MultiModel::Outcome> MultiModel::look_flat(Candidate& best, Outcome otherwise) {
  // A curved model that lies in a plane may have no more points than its surroundings, and hold the swarms all the same; and samples of
  // what is flat determine none.
  if (otherwise == Outcome::unpaid && best.support.inliers() < settings_.min_inliers) return otherwise;
  if (std::exchange(looked_flat_, true)) return otherwise;
  Candidate flat;
  flat.kind = kinds_.size() - 1;
  const std::size_t steps = steps_;
  const std::string reason = stop_reason_;
  auto outcome = explore(kFirstContest + contests_++, {}, flat);
  steps_ = steps;
  if (!outcome) return outcome;
  if (interrupted()) return Outcome::interrupted;
  stop_reason_ = reason;
  if (*outcome != Outcome::found) return otherwise;
  stop_reason_.clear();
  best = std::move(flat);
  return Outcome::flat;
}

Expected<MultiModel::Outcome> MultiModel::flatten(Candidate& winner, models::Position flat) {
  winner.kind = flat_kind(winner.kind);
  if (flat.size() == 0) return Outcome::unpaid;
  winner.theta = std::move(flat);
  if (auto done = refine(winner); !done) return tl::unexpected(done.error());
  if (!pays(winner.support, kinds_[winner.kind].settings, space(winner.kind).minimal_sample())) return Outcome::unpaid;
  return kinds_[winner.kind].hidden ? Outcome::flat : Outcome::found;
}

}  // namespace swarmfit::swarm
