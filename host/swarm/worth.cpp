#include "host/swarm/worth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

#include "host/swarm/swarm.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr double kAlong = 0.8;        // cosine of the angle between a point's normal and the model's
constexpr double kHeld = 0.4;         // share of its points that must lie along it, times that of neighbours alike,
constexpr double kHeldPerBeside = 2;  // and so much more for each point beside it, of its own
constexpr std::size_t kBesides = 8;   // nearest neighbours of a point that are asked whose they are
constexpr double kThin = 6;           // tau: a cylinder that is wider lies about no box on all sides
constexpr std::size_t kNext = 4;      // nearest neighbours of a point along it that are asked how far off they are
constexpr double kEven = 0.8;         // von Neumann's ratio: below, they are off to the same side
constexpr double kBent = 0.15;        // tau: root mean square of how far a plane's points bend away from it: below, they lie flat,
constexpr std::size_t kFewest = 32;   // of these: fewer bend by chance, or not,
constexpr double kGoesOn = 0.1;       // unless so many times as many are right beside it: the surface goes on there, bent

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

double Worth::of(double saved, int freedom) const {
  // A parameter costs what it takes to write it down, half the logarithm of the number of points (Schwarz 1978), in points explained.
  const double price = 0.5 * std::log(static_cast<double>(problem_.points.finite_count()));
  return saved / problem_.settings.threshold - price * freedom;
}

double Worth::of(const Candidate& candidate) const {
  const double saved =
      bare_saving(left_.caps(), candidate.distances) * agreement(candidate.kind, candidate.theta, left_.caps(), candidate.distances);
  return of(saved, problem_.space(candidate.kind).freedom());
}

double Worth::agreement(std::size_t kind, const models::Position& theta, std::span<const float> caps,
                        std::span<const float> distances) const {
  if (!problem_.points.has_normals()) return 1;
  Along tally;
  for (const std::uint32_t i : problem_.part.index()) {
    if (distances[i] < caps[i]) tally.count(problem_.points, i, problem_.space(kind), theta);
  }
  return tally.share();
}

double Worth::gathered(const Candidate& candidate) const {
  // Points of a surface gather about it; those of faces that it happens to cross are strewn over its slab, at any angle to it.
  // In the plane nothing but the distance tells, and outliers fill the slab of a true circle as well.
  if (problem_.points.dimension() != 3) return 1;
  const float half = 0.5F * problem_.tau;
  double all = 0, inner = 0;
  kernels::Reused<float> room;
  const std::span<const float> distances = problem_.levelled(candidate.distances, room);
  for (const std::uint32_t i : problem_.part.index()) {
    if (!(candidate.distances[i] < left_.caps()[i])) continue;
    ++all;
    inner += distances[i] < half ? 1 : 0;
  }
  return inner / std::max(1.0, all) * agreement(candidate.kind, candidate.theta, left_.caps(), candidate.distances);
}

double Worth::held(const Candidate& candidate) const {
  const std::span<const std::uint32_t> index = problem_.part.index();
  const auto own = [&](std::uint32_t i) { return candidate.distances[i] < left_.caps()[i]; };
  double all = 0, like = 0;
  for (std::size_t place = 0; place < index.size(); ++place) {
    if (!own(index[place])) continue;
    const auto near = problem_.neighbours.of(place).first(std::min(kBesides, problem_.neighbours.count()));
    all += static_cast<double>(near.size());
    like += static_cast<double>(std::count_if(near.begin(), near.end(), [&](std::uint32_t other) { return own(index[other]); }));
  }
  return like / std::max(1.0, all) * agreement(candidate.kind, candidate.theta, left_.caps(), candidate.distances);
}

bool Worth::is_strewn(const Candidate& candidate) const {
  if (problem_.points.dimension() != 3) return false;
  // What is one surface is a peak as well: among outliers its points have strangers for neighbours, but hardly any in the slab beside it.
  const Support& support = candidate.support;
  const double beside = static_cast<double>(support.slabs[1]) / static_cast<double>(std::max<std::size_t>(support.inliers(), 1));
  return held(candidate) < kHeld + kHeldPerBeside * beside;
}

bool Worth::lies_flat(const Candidate& candidate) const {
  if (problem_.space(candidate.kind).type() != ModelType::plane || !problem_.allowed.empty()) return false;
  const Support& support = candidate.support;
  if (static_cast<double>(support.slabs[1]) > kGoesOn * static_cast<double>(support.inliers())) return false;
  const Eigen::Vector3d normal = candidate.theta.head<3>(), x = normal.unitOrthogonal(), y = normal.cross(x);
  std::vector<Eigen::Vector3d> own;  // along x and y, and off the plane
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t i : problem_.part.index()) {
    if (!(candidate.distances[i] < left_.caps()[i])) continue;
    const Eigen::Vector3d at = problem_.points.point<3>(i);
    own.emplace_back(at.dot(x), at.dot(y), at.dot(normal));
    mean += own.back();
  }
  if (own.size() < kFewest) return false;
  const auto count = static_cast<double>(own.size());
  mean /= count;
  Eigen::Vector3d square = Eigen::Vector3d::Constant(1e-300);
  for (Eigen::Vector3d& at : own) {
    at -= mean;
    square += at.cwiseAbs2();
  }
  // Least squares of how far off they are by 1, u and v, and by u^2, uv and v^2 as well, which are all of size 1.
  const Eigen::Vector3d size = (square / count).cwiseSqrt();
  using Terms = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> products = Eigen::Matrix<double, 6, 6>::Zero();
  Terms off = Terms::Zero();
  for (const Eigen::Vector3d& at : own) {
    const double u = at[0] / size[0], v = at[1] / size[1];
    const Terms terms{1, u, v, u * u, u * v, v * v};
    products += terms * terms.transpose();
    off += at[2] * terms;
  }
  const double by_plane = off.head<3>().dot(products.topLeftCorner<3, 3>().ldlt().solve(off.head<3>()));
  const double by_bending = off.dot(products.ldlt().solve(off)) - by_plane;
  const double least = kBent * static_cast<double>(problem_.tau) / problem_.points.frame().scale;
  return by_bending < least * least * count;
}

bool Worth::is_cornered(const Candidate& candidate) const {
  if (problem_.space(candidate.kind).type() != ModelType::cylinder) return false;
  // A wider box is not within tau of a cylinder about it.
  const double radius = candidate.theta[candidate.theta.size() - 1], unit = problem_.points.frame().scale;
  if (radius * unit > kThin * static_cast<double>(problem_.tau)) return false;
  const std::span<const std::uint32_t> index = problem_.part.index();
  const auto own = [&](std::uint32_t i) { return candidate.distances[i] < left_.caps()[i]; };
  const auto off = [&](const Eigen::Vector3d& at) { return problem_.space(candidate.kind).outward(candidate.theta, at).norm() - radius; };
  double apart = 0, square = 0;
  kernels::Reused<std::pair<double, double>> near;
  for (std::size_t place = 0; place < index.size(); ++place) {
    if (!own(index[place])) continue;
    const Eigen::Vector3d at = problem_.points.point<3>(index[place]);
    const double here = off(at);
    // What is nearest in space is nearest in how far it is off as well; along the surface, noise knows nothing of its neighbours.
    near.clear();
    for (const std::uint32_t other : problem_.neighbours.of(place)) {
      if (!own(index[other])) continue;
      const Eigen::Vector3d there = problem_.points.point<3>(index[other]);
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

double Worth::bare_saving(std::span<const float> caps, std::span<const float> distances) const {
  kernels::Reused<float> caps_room, room;
  return saved(problem_.levelled(caps, caps_room), problem_.levelled(distances, room));
}

Expected<> Worth::choose(const Swarm& swarm, Candidate& candidate) const {
  kernels::Reused<models::Placed> known{{&problem_.space(candidate.kind), swarm.best()}};
  for (const std::size_t particle : swarm.best_of_stretches()) {
    known.push_back({&problem_.space(candidate.kind), swarm.own_bests()[particle]});
  }
  const auto distances = measure(problem_.part_ground, known);
  if (!distances) return tl::unexpected(distances.error());
  kernels::Reused<double> savings(known.size());
  problem_.evaluator.share_out(known.size(),
                               [&](std::size_t m) { savings[m] = saving_along(candidate.kind, known[m].theta, (*distances)[m]); });
  const auto most = std::max_element(savings.begin(), savings.end());
  if (*most > 0) candidate.theta = known[static_cast<std::size_t>(most - savings.begin())].theta;
  return {};
}

double Worth::saving_along(std::size_t kind, const models::Position& theta, std::span<const float> distances) const {
  Along tally;
  double saved = 0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    if (!(distances[k] < left_.part_caps()[k])) continue;
    saved += static_cast<double>(left_.part_caps()[k] - distances[k]) / static_cast<double>(problem_.part_ground.allowed_at(k));
    tally.count(problem_.points, problem_.part.index()[k], problem_.space(kind), theta);
  }
  return saved * tally.share();
}

}  // namespace swarmfit::swarm
