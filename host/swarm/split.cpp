#include "host/swarm/split.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "host/swarm/sampler.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

using Halves = std::array<models::Position, 2>;

constexpr std::uint32_t kFirstSplit = 3U << 30;  // rounds of samples, apart from those of searches and of contests
constexpr double kLoose = 0.3;                   // of tau: root mean square of a plane's own distances that asks for a closer look
constexpr std::size_t kPairs = 256;              // of neighbours whose distances are compared, about
constexpr double kEven = 0.65;                   // of the square of their difference that two distances have by chance: noise has no more
constexpr float kAround = 5;                     // tau: so far from the suspect its surfaces are looked at
constexpr std::size_t kLookedAt = 256;           // points, at most
constexpr std::uint32_t kSamples = 32;           // planes through neighbouring points, of which the best pair is taken
constexpr float kNarrow = 0.5F;                  // of tau: so near are points that speak for one of them
constexpr double kCrossing = 0.866;              // cosine of the least angle at which two surfaces cross
constexpr int kTurns = 6;                        // of refinement, of one and the other
// What a pair must be worth, in points that a model must have: what it saves beyond the suspect, what either half has that is nearer to it
// than to the other, and what of that the other would not take with it. Counted on few points, so that chance has some room.
constexpr double kGain = 0.4, kNearer = 0.9, kClear = 0.7;
constexpr float kTaken = 1.25F;  // tau: nearer points no longer count as unexplained once a plane has been found

bool cross(const models::Position& a, const models::Position& b) { return std::abs(a.head<3>().dot(b.head<3>())) < kCrossing; }

/// Points that may save something yet: those within tau of the suspect, in their order, and those around it.
struct Places {
  kernels::Reused<std::uint32_t> own, around;  ///< input indices
  kernels::Reused<float> caps, distances;      ///< of those around
};

Places places_of(const Ground& part, const Suspect& suspect) {
  Places places;
  for (std::size_t k = 0; k < part.size(); ++k) {
    const std::uint32_t i = part.index(k);
    const float d = suspect.distances[i], cap = suspect.caps[i];
    if (!(d < kAround * part.tau) || cap < kUnexplained * part.tau) continue;
    places.around.push_back(i);
    if (d < part.tau) places.own.push_back(i);
  }
  return places;
}

/// Every so many of the points around, and what they may save.
void thin_out(const Suspect& suspect, Places& places) {
  std::vector<std::uint32_t>& around = places.around;
  const std::size_t all = around.size(), kept = std::min(all, kLookedAt);
  for (std::size_t k = 0; k < kept; ++k) {
    around[k] = around[k * all / kept];
    places.caps.push_back(suspect.caps[around[k]]);
    places.distances.push_back(suspect.distances[around[k]]);
  }
  around.resize(kept);
}

/// Noise knows nothing of its neighbours; where a plane runs across a surface, neighbours are off to the same side.
bool leans(const Ground& part, const Suspect& suspect, std::span<const std::uint32_t> own) {
  const auto off = [&](std::uint32_t i) { return suspect.theta.head<3>().dot(part.points.point<3>(i)) + suspect.theta[3]; };
  const std::size_t step = std::max<std::size_t>(1, own.size() / kPairs);
  double apart = 0, square = 0;
  for (std::size_t k = 0; k + 1 < own.size(); k += step) {
    const double a = off(own[k]), b = off(own[k + 1]);
    apart += (a - b) * (a - b);
    square += a * a + b * b;
  }
  return apart < kEven * square;
}

/// Some points around a plane, apart from the cloud.
class Neighbourhood {
 public:
  Neighbourhood(const Ground& part, std::span<const std::uint32_t> index)
      : part_(part), rows_(part.points.view(), index), size_(index.size()) {}

  /// Distances of all points to the first plane, then to the second, and so on; and what those say of each that are near enough.
  Expected<> weigh(std::span<const models::Position> planes, float tolerance, std::span<const float> caps, std::vector<float>& distances,
                   std::vector<kernels::Evidence>& evidence) const {
    ModelRows models(part_.points.frame(), planes.size());
    for (const models::Position& theta : planes) models.add(part_.space, theta);
    distances.resize(planes.size() * size_);
    evidence.resize(planes.size());
    const kernels::Weighing how{tolerance, part_.corner, caps};
    if (auto done = part_.evaluator.weigh(models::to_kernel(rows_.view()), how, models.views(), distances, evidence); !done) {
      return tl::unexpected(to_error(done.error()));
    }
    return {};
  }

  void refine(const kernels::Evidence& evidence, models::Position& theta) const {
    models::Position candidate = theta;
    const bool enough = evidence.count >= static_cast<std::uint64_t>(part_.space.minimal_sample());
    if (enough && part_.space.refine_by_moments(evidence.moments, part_.points.frame(), candidate)) theta = candidate;
  }

 private:
  const Ground& part_;
  Rows rows_;
  std::size_t size_;
};

/// What two planes save together, point by point what the better of them does; in lanes, which a processor adds side by side.
double saved_by_both(const float* x, const float* y, std::size_t n) {
  constexpr std::size_t kLanes = 16;
  std::array<float, kLanes> lanes{};
  const std::size_t even = n / kLanes * kLanes;
  for (std::size_t i = 0; i < even; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] += x[i + k] > y[i + k] ? x[i + k] : y[i + k];
  }
  double sum = 0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  for (std::size_t i = even; i < n; ++i) sum += static_cast<double>(std::max(x[i], y[i]));
  return sum;
}

/// Of planes that cross, the two that save most together; false if none saves more than `least`. `savings`: what each saves of each point.
bool best_pair(std::span<const models::Position> planes, std::span<const float> savings, double least, Halves& pair) {
  const std::size_t n = savings.size() / planes.size();
  kernels::Reused<double> alone(planes.size());
  kernels::Reused<std::size_t> order(planes.size());
  for (std::size_t k = 0; k < planes.size(); ++k) alone[k] = std::accumulate(&savings[k * n], &savings[k * n] + n, 0.0);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return alone[a] > alone[b] || (alone[a] == alone[b] && a < b); });
  bool found = false;
  for (std::size_t p = 0; p < order.size(); ++p) {
    // Together they save no more than each by itself.
    for (std::size_t q = p + 1; q < order.size() && alone[order[p]] + alone[order[q]] > least; ++q) {
      if (!cross(planes[order[p]], planes[order[q]])) continue;
      const double together = saved_by_both(&savings[order[p] * n], &savings[order[q] * n], n);
      if (together <= least) continue;
      least = together;
      pair = {planes[order[p]], planes[order[q]]};
      found = true;
    }
  }
  return found;
}

/// Each refined in turn on what the other leaves it; at last the distances to both.
Expected<> settle_pair(const Neighbourhood& there, std::span<const float> caps, float tau, Halves& pair,
                       std::array<kernels::Reused<float>, 2>& distances) {
  kernels::Reused<kernels::Evidence> evidence;
  if (auto done = there.weigh(std::span(pair).subspan(1), tau, {}, distances[1], evidence); !done) return done;
  kernels::Reused<float> left(caps.size());
  for (std::size_t turn = 0; turn < kTurns; ++turn) {
    const std::size_t mine = turn % 2;
    std::copy(caps.begin(), caps.end(), left.begin());
    take_nearer(distances[1 - mine], left);
    if (auto done = there.weigh(std::span(pair).subspan(mine, 1), tau, left, distances[mine], evidence); !done) return done;
    if (turn + 2 < kTurns) there.refine(evidence.front(), pair[mine]);
  }
  return {};
}

/// Does a pair save enough beyond the suspect, and has either half enough of its own? `stands_for`: points of the cloud for each of these.
bool worth_two(const Places& places, const std::array<kernels::Reused<float>, 2>& distances, float tau, double stands_for,
               std::size_t least) {
  std::array<double, 2> nearer{}, clear{};
  double gain = 0;
  for (std::size_t i = 0; i < places.caps.size(); ++i) {
    const std::size_t whose = distances[0][i] <= distances[1][i] ? 0 : 1;
    const float cap = places.caps[i], mine = distances[whose][i], others = distances[1 - whose][i];
    gain += static_cast<double>(std::min(cap, places.distances[i]) - std::min(cap, mine)) / static_cast<double>(tau);
    if (!(mine < tau)) continue;
    ++nearer[whose];
    clear[whose] += others > kTaken * tau ? 1 : 0;
  }
  const double must = static_cast<double>(least) / stands_for;
  return gain > kGain * must && std::min(nearer[0], nearer[1]) > kNearer * must && std::min(clear[0], clear[1]) > kClear * must;
}

}  // namespace

bool looks_loose(const Support& support, double tau) {
  const double square = kLoose * kLoose * tau * tau;
  return support.square > square * static_cast<double>(support.inliers());
}

Expected<std::optional<Halves>> crossing_pair(const Ground& part, const Suspect& suspect, const Random& random, std::uint32_t number) {
  Places places = places_of(part, suspect);
  if (places.own.size() < static_cast<std::size_t>(4 * part.space.minimal_sample()) || !leans(part, suspect, places.own))
    return std::nullopt;
  const double all = static_cast<double>(places.around.size()) * static_cast<double>(part.points.finite_count());
  thin_out(suspect, places);

  const models::Neighbours none;
  const Sampler sampler(part.points, places.own, none, part.space, random);
  kernels::Reused<models::Position> planes = sampler.draw_some(kSamples, 1, kFirstSplit + number);
  const Neighbourhood there(part, places.around);
  kernels::Reused<float> savings;
  kernels::Reused<kernels::Evidence> evidence;
  if (auto done = there.weigh(planes, kNarrow * part.tau, {}, savings, evidence); !done) return tl::unexpected(done.error());
  for (std::size_t k = 0; k < planes.size(); ++k) there.refine(evidence[k], planes[k]);
  if (auto done = there.weigh(planes, kNarrow * part.tau, {}, savings, evidence); !done) return tl::unexpected(done.error());
  const std::size_t n = places.caps.size();
  for (std::size_t first = 0; first < savings.size(); first += n) {
    for (std::size_t i = 0; i < n; ++i) {
      const float left = places.caps[i] - savings[first + i];
      savings[first + i] = left > 0 ? left : 0;
    }
  }

  Halves pair;
  if (planes.empty() || !best_pair(planes, savings, saved(places.caps, places.distances), pair)) return std::nullopt;
  std::array<kernels::Reused<float>, 2> distances;
  if (auto done = settle_pair(there, places.caps, part.tau, pair, distances); !done) return tl::unexpected(done.error());
  const double stands_for = all / (static_cast<double>(n) * static_cast<double>(part.size()));
  if (!cross(pair[0], pair[1]) || !worth_two(places, distances, part.tau, stands_for, suspect.least)) return std::nullopt;
  return pair;
}

}  // namespace swarmfit::swarm
