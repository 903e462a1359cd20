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
constexpr std::size_t kStretches = 6;              // of a swarm's ring, whose bests are looked at
constexpr int kBriefStall = 1;                     // still steps that end a swarm on one model's points
constexpr double kGathered = 0.65;                 // share of a curved model's points that must gather about it
constexpr double kWellGathered = 0.8;              // the same: above, it is not asked against as many faces as a box has
constexpr double kHeld = 0.4;                      // share of its points that must lie along it, times that of neighbours alike,
constexpr double kHeldPerBeside = 2;               // and so much more for each point beside it, of its own
constexpr std::size_t kBesides = 8;                // nearest neighbours of a point that are asked whose they are
constexpr double kThin = 6;                        // tau: a cylinder that is wider lies about no box on all sides
constexpr std::size_t kNext = 4;                   // nearest neighbours of a point along it that are asked how far off they are
constexpr double kEven = 0.8;                      // von Neumann's ratio: below, they are off to the same side
constexpr double kAsGood = 0.95;                   // times what the faces of a box save: such a cylinder must save more
constexpr double kClearly = 1.1;                   // times what a flat model is worth: a curved one must be worth more

/// The caps of those points that a model explains; 0 elsewhere.
std::vector<float> own_caps(std::span<const float> caps, std::span<const float> distances) {
  std::vector<float> own(caps.size());
  for (std::size_t i = 0; i < caps.size(); ++i) own[i] = distances[i] < caps[i] ? caps[i] : 0.0F;
  return own;
}

/// How many of a model's points lie along it, of those whose surface is known; one is added so that no points are no cause for doubt.
class Along {
 public:
  void count(const models::WorkingPoints& points, std::uint32_t i, const models::ModelSpace& space, const models::Position& theta) {
    const Eigen::Vector3d normal = points.normal(i);
    if (normal.isZero()) return;
    const Eigen::Vector3d outward = space.outward(theta, points.point<3>(i));
    ++all_;
    if (std::abs(normal.dot(outward)) >= kAlong * outward.norm()) ++along_;
  }
  double share() const noexcept { return along_ / all_; }

 private:
  double all_ = 1, along_ = 1;
};

}  // namespace

double MultiModel::worth(double saved, int freedom) const {
  // A parameter costs what it takes to write it down, half the logarithm of the number of points (Schwarz 1978), in points explained.
  const double price = 0.5 * std::log(static_cast<double>(points_.finite_count()));
  return saved / settings_.threshold - price * freedom;
}

double MultiModel::worth(const Candidate& candidate) const {
  const double saved = bare_saving(caps_, candidate.distances) * agreement(candidate.kind, candidate.theta, caps_, candidate.distances);
  return worth(saved, space(candidate.kind).freedom());
}

double MultiModel::agreement(std::size_t kind, const models::Position& theta, std::span<const float> caps,
                             std::span<const float> distances) const {
  if (!points_.has_normals()) return 1;
  Along tally;
  for (const std::uint32_t i : part_.index()) {
    if (distances[i] < caps[i]) tally.count(points_, i, space(kind), theta);
  }
  return tally.share();
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

double MultiModel::held(const Candidate& candidate) const {
  const std::span<const std::uint32_t> index = part_.index();
  const auto own = [&](std::uint32_t i) { return candidate.distances[i] < caps_[i]; };
  double all = 0, like = 0;
  for (std::size_t place = 0; place < index.size(); ++place) {
    if (!own(index[place])) continue;
    const auto near = neighbours_.of(place).first(std::min(kBesides, neighbours_.count()));
    all += static_cast<double>(near.size());
    like += static_cast<double>(std::count_if(near.begin(), near.end(), [&](std::uint32_t other) { return own(index[other]); }));
  }
  return like / std::max(1.0, all) * agreement(candidate.kind, candidate.theta, caps_, candidate.distances);
}

bool MultiModel::is_strewn(const Candidate& candidate) const {
  if (points_.dimension() != 3) return false;
  // What is one surface is a peak as well: among outliers its points have strangers for neighbours, but hardly any in the slab beside it.
  const Support& support = candidate.support;
  const double beside = static_cast<double>(support.slabs[1]) / static_cast<double>(std::max<std::size_t>(support.inliers(), 1));
  return held(candidate) < kHeld + kHeldPerBeside * beside;
}

bool MultiModel::is_cornered(const Candidate& candidate) const {
  if (space(candidate.kind).type() != ModelType::cylinder) return false;
  // A wider box is not within tau of a cylinder about it.
  const double radius = candidate.theta[candidate.theta.size() - 1], unit = points_.frame().scale;
  if (radius * unit > kThin * static_cast<double>(tau_)) return false;
  const std::span<const std::uint32_t> index = part_.index();
  const auto own = [&](std::uint32_t i) { return candidate.distances[i] < caps_[i]; };
  const auto off = [&](const Eigen::Vector3d& at) { return space(candidate.kind).outward(candidate.theta, at).norm() - radius; };
  double apart = 0, square = 0;
  std::vector<std::pair<double, double>> near;
  for (std::size_t place = 0; place < index.size(); ++place) {
    if (!own(index[place])) continue;
    const Eigen::Vector3d at = points_.point<3>(index[place]);
    const double here = off(at);
    // What is nearest in space is nearest in how far it is off as well; along the surface, noise knows nothing of its neighbours.
    near.clear();
    for (const std::uint32_t other : neighbours_.of(place)) {
      if (!own(index[other])) continue;
      const Eigen::Vector3d there = points_.point<3>(index[other]);
      const double its = off(there);
      near.emplace_back((there - at).squaredNorm() - (its - here) * (its - here), its);
    }
    const auto last = near.begin() + static_cast<std::ptrdiff_t>(std::min(kNext, near.size()));
    std::partial_sort(near.begin(), last, near.end());
    for (auto other = near.begin(); other != last; ++other) {
      apart += (here - other->second) * (here - other->second);
      square += here * here + other->second * other->second;
    }
  }
  return apart < kEven * square;
}

double MultiModel::bare_saving(std::span<const float> caps, std::span<const float> distances) const {
  std::vector<float> caps_room, room;
  return saved(levelled(caps, caps_room), levelled(distances, room));
}

std::size_t MultiModel::flat_kind(std::size_t curved) const noexcept {
  if (!is_curved(space(curved).type())) return kinds_.size();
  if (hides_flat()) return kinds_.size() - 1;
  const ModelType flat = flat_of(space(curved).type());
  const auto at = std::find_if(kinds_.begin(), kinds_.end(), [&](const Kind& kind) { return kind.space->type() == flat; });
  return static_cast<std::size_t>(at - kinds_.begin());
}

Expected<> MultiModel::choose(const Swarm& swarm, Candidate& candidate) const {
  // Neighbours on the ring know alike: one of each stretch is enough.
  const std::size_t particles = swarm.own_bests().size();
  std::vector<models::Placed> known{{&space(candidate.kind), swarm.best()}};
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t first = k * particles / kStretches, last = (k + 1) * particles / kStretches;
    const auto stretch = swarm.own_fitness().subspan(first, last - first);
    if (stretch.empty()) continue;
    const auto best = static_cast<std::size_t>(std::min_element(stretch.begin(), stretch.end()) - stretch.begin());
    known.push_back({&space(candidate.kind), swarm.own_bests()[first + best]});
  }
  const auto distances = measure(part_ground_, known);
  if (!distances) return tl::unexpected(distances.error());
  double most = 0;
  for (std::size_t m = 0; m < known.size(); ++m) {
    const double now = saving_along(candidate.kind, known[m].theta, (*distances)[m]);
    if (!(now > most)) continue;
    most = now;
    candidate.theta = known[m].theta;
  }
  return {};
}

double MultiModel::saving_along(std::size_t kind, const models::Position& theta, std::span<const float> distances) const {
  Along tally;
  double saved = 0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    if (!(distances[k] < part_caps_[k])) continue;
    saved += static_cast<double>(part_caps_[k] - distances[k]) / static_cast<double>(part_ground_.allowed_at(k));
    tally.count(points_, part_.index()[k], space(kind), theta);
  }
  return saved * tally.share();
}

Expected<MultiModel::Outcome> MultiModel::contest(Candidate& winner) {
  if (auto done = challenge_by(0, asked_, winner); !done) return tl::unexpected(done.error());
  if (interrupted()) return Outcome::interrupted;
  if (flat_kind(winner.kind) == kinds_.size()) return Outcome::found;
  models::Position flat;
  auto curved = bends(winner, flat);
  if (!curved) return tl::unexpected(curved.error());
  if (interrupted()) return Outcome::interrupted;
  if (!*curved) return flatten(winner, std::move(flat));
  // What is round in another way than was asked for is not to be pieced together.
  if (auto done = challenge_by(asked_, kinds_.size(), winner); !done) return tl::unexpected(done.error());
  if (interrupted()) return Outcome::interrupted;
  return kinds_[winner.kind].hidden ? Outcome::flat : Outcome::found;
}

Expected<> MultiModel::challenge_by(std::size_t first, std::size_t last, Candidate& winner) {
  for (std::size_t kind = first; kind < last; ++kind) {
    if (kind == winner.kind || !is_curved(space(kind).type())) continue;
    Candidate challenger;
    challenger.kind = kind;
    auto there = challenge(winner, challenger);
    if (!there) return tl::unexpected(there.error());
    if (interrupted()) return {};
    if (*there && worth(challenger) > worth(winner)) winner = std::move(challenger);
  }
  return {};
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
  const double bare = bare_saving(caps, winner.distances);
  const double own = worth(bare * agreement(winner.kind, winner.theta, caps, winner.distances), space(winner.kind).freedom());
  const double share = gathered(winner);
  const bool strewn = share < kGathered || is_strewn(winner);
  // Normals near the edges of a thin box are those of a cylinder: there the distances alone decide.
  const bool cornered = !strewn && is_cornered(winner);
  const int asked = share < kWellGathered ? kFaces : kFlats, most = cornered ? kFaces : asked;
  double together = 0, bare_together = 0;
  for (int flats = 1; flats <= most; ++flats) {
    models::Position theta;
    auto there = best_on(kind, caps, theta, distances);
    if (!there) return there;
    if (!*there) return !strewn;
    if (flats == 1) flat = theta;
    if (strewn) return false;
    const double theirs_bare = bare_saving(caps, distances);
    together += theirs_bare * agreement(kind, theta, caps, distances);
    bare_together += theirs_bare;
    if (flats <= asked && own <= kClearly * worth(together, flats * space(kind).freedom())) return false;
    if (cornered && bare <= kAsGood * bare_together) return false;
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
