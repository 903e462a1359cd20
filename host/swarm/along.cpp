#include "host/swarm/along.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "host/models/neighbours.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kMost = 2048;      // points of a model that are looked at: more would say little more
constexpr std::size_t kFewest = 32;      // of them: fewer say too little
constexpr std::size_t kNeighbours = 16;  // of a point, whose plane has its normal
constexpr float kReach = 2;              // tau: points so near have a say in normals, be it that they are beyond the threshold
constexpr double kAlong = 0.95;          // cosine of the angle between a point's normal and the model's: 18 degrees
constexpr double kMostly = 0.6;          // share of a model's points that must lie along it: below, it is noise that turns normals
constexpr int kPasses = 2;               // who lies along a model is asked again once it has moved

/// Input indices of points near a model that nothing else explains better, kMost at most, evenly over the input. `left`: what others leave.
kernels::Reused<std::uint32_t> surroundings(const Ground& whole, std::span<const float> distances, std::span<const float> left) {
  kernels::Reused<std::uint32_t> near, drawn;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const float allowed = whole.allowed_at(i), d = distances[i];
    if (d <= left[i] || (d <= kReach * allowed && left[i] == allowed)) near.push_back(static_cast<std::uint32_t>(i));
  }
  if (near.size() <= kMost) return near;
  drawn.reserve(kMost);
  for (std::size_t k = 0; k < kMost; ++k) drawn.push_back(near[k * near.size() / kMost]);
  return drawn;
}

/// Cosines of the angles between points' normals and a model's; 0 where a normal is not known.
kernels::Reused<double> cosines_of(const Ground& part, std::span<const Eigen::Vector3f> normals, const models::Position& theta) {
  kernels::Reused<double> cosines(part.size());
  for (std::size_t k = 0; k < cosines.size(); ++k) {
    const Eigen::Vector3d outward = part.space.outward(theta, part.points.point<3>(part.index(k)));
    cosines[k] = std::abs(normals[k].cast<double>().dot(outward)) / std::max(outward.norm(), 1e-12);
  }
  return cosines;
}

/// Caps of the points by which a model is to be refined: what they may be off, or 0 of those that do not lie along it. None where too few
/// do.
kernels::Reused<float> caps_along(const Ground& part, std::span<const double> cosines, std::span<const float> distances) {
  kernels::Reused<float> caps(cosines.size());
  std::size_t own = 0, along = 0;
  for (std::size_t k = 0; k < caps.size(); ++k) {
    const bool near = distances[k] <= part.allowed_at(k), lies = cosines[k] >= kAlong;
    caps[k] = lies ? part.allowed_at(k) : 0.0F;
    own += near ? 1 : 0;
    along += near && lies ? 1 : 0;
  }
  if (along < kFewest || static_cast<double>(along) < kMostly * static_cast<double>(own)) caps.clear();
  return caps;
}

Expected<> refine_on(const Ground& part, std::span<const Eigen::Vector3f> normals, models::Placed& model) {
  for (int pass = 0; pass < kPasses; ++pass) {
    const auto distances = measure(part, std::span(&model, 1));
    if (!distances) return tl::unexpected(distances.error());
    const kernels::Reused<float> caps = caps_along(part, cosines_of(part, normals, model.theta), distances->front());
    if (caps.empty()) return {};
    if (auto done = refine_one(part, Loss::truncated_l1, caps, model.theta); !done) return tl::unexpected(done.error());
  }
  return {};
}

}  // namespace

Expected<> refine_along(const Ground& whole, std::vector<models::Placed>& found, std::span<const models::Placed> hidden) {
  const auto is_round = [](const models::Placed& model) { return is_curved(model.space->type()); };
  if (whole.points.dimension() != 3 || std::none_of(found.begin(), found.end(), is_round)) return {};
  kernels::Reused<models::Placed> all = found;
  all.insert(all.end(), hidden.begin(), hidden.end());
  const auto nearest = TwoNearest::of(whole, all);
  if (!nearest) return tl::unexpected(nearest.error());
  kernels::Reused<float> left(whole.size()), distances(whole.size()), allowed;
  for (std::size_t m = 0; m < found.size(); ++m) {
    if (!is_round(found[m])) continue;
    nearest->left_by_others(whole, m, left);
    if (const auto told = weigh(whole.of(*found[m].space), found[m].theta, {}, distances); !told) return tl::unexpected(told.error());
    const kernels::Reused<std::uint32_t> near = surroundings(whole, distances, left);
    if (near.size() < kFewest) continue;
    const Subset subset(whole.points, near);
    Ground part{.evaluator = whole.evaluator, .space = *found[m].space, .points = whole.points, .tau = whole.tau, .part = &subset};
    if (!whole.allowed.empty()) subset.gather(whole.allowed, allowed);
    part.allow(allowed);
    const models::Neighbours neighbours(whole.points, subset.index(), kNeighbours, &whole.evaluator);
    const auto normals = models::estimate_normals(whole.points, subset.index(), neighbours, &whole.evaluator);
    if (auto done = refine_on(part, normals, found[m]); !done) return done;
  }
  return {};
}

}  // namespace swarmfit::swarm
