#include "host/perception/tracking.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "host/perception/assignment.hpp"

namespace swarmfit::perception {
namespace {

// Costs are in units of the gate: 1 is at its edge.
constexpr double kGate = 1;
constexpr double kPlaneOffset = 0.05;     // [m] a plane's height changes less than this between frames
constexpr double kPlaneAngle = 0.15;      // [rad] and its direction less than this
constexpr double kLeastReach = 0.03;      // [m] a small thing's centre may move by this much
constexpr double kMostReach = 0.12;       // [m] a large one's by no more than this
constexpr double kReachOfRadius = 0.6;    // between these, in sums of both radii
constexpr double kSizeRatio = 2.2;        // the larger radius over the smaller
constexpr double kSizeWeight = 0.3;       // of a size at the edge of what is allowed, to a distance at its edge
constexpr double kMemoryWeight = 0.01;    // a frame out of sight: who was seen just now goes first
constexpr double kNewcomer = 0.3;         // who was never seen before last frame: what was there long is rather there still
constexpr int kSettled = 30;              // frames after which one is no newcomer
constexpr int kRemembered = 90;           // frames that a thing out of sight is remembered
constexpr int kSeeded = 10;               // frames that a plane out of sight still seeds the swarm
constexpr std::size_t kMostSpaces = 512;  // and no more than this, the latest
constexpr double kNewRadius = 0.3;        // weight of the latest radius
constexpr std::size_t kLeastPairs = 4;    // fewer do not tell how the camera moved
constexpr double kStandsStill = 0.02;     // [m] a pair farther off the common motion moves by itself

/// In favour of what was seen just now and of what was seen often.
template <class Track>
double unlikely(const Track& track) {
  return kMemoryWeight * std::min(track.missed, 20) + kNewcomer * (kSettled - track.seen) / kSettled;
}
constexpr double kMostUnlikely = 20 * kMemoryWeight + kNewcomer;

double cost_of(const Model& before, const Model& now) {
  const double angle = std::acos(std::clamp(before.normal().dot(now.normal()), -1.0, 1.0));
  const double shift = std::abs(before.offset() - now.offset());
  if (angle > kPlaneAngle || shift > kPlaneOffset) return std::numeric_limits<double>::infinity();
  return 0.8 * shift / kPlaneOffset + 0.2 * angle / kPlaneAngle;
}

/// n . x + d = 0 after everything has been moved.
Model moved(Model plane, const Eigen::Isometry3d& motion) {
  const Eigen::Vector3d normal = motion.linear() * plane.normal();
  plane.parameters[3] -= normal.dot(motion.translation());
  plane.parameters.head<3>() = normal;
  return plane;
}

struct Pair {
  Eigen::Vector3d before, now;
};

/// The turn about `up` and the shift that bring most pairs together: least squares over pairs, those far off left out in the second round.
Eigen::Isometry3d common_motion(std::vector<Pair> pairs, const Eigen::Vector3d& up) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  for (int round = 0; round < 3; ++round) {
    if (pairs.size() < kLeastPairs) return Eigen::Isometry3d::Identity();
    Eigen::Vector3d before = Eigen::Vector3d::Zero(), now = Eigen::Vector3d::Zero();
    for (const Pair& p : pairs) {
      before += p.before / static_cast<double>(pairs.size());
      now += p.now / static_cast<double>(pairs.size());
    }
    double along = 0, across = 0;
    for (const Pair& p : pairs) {
      const Eigen::Vector3d a = (p.before - before) - up * up.dot(p.before - before), b = p.now - now;
      along += a.dot(b);
      across += up.dot(a.cross(b));
    }
    motion.linear() = Eigen::AngleAxisd(std::atan2(across, along), up).toRotationMatrix();
    motion.translation() = now - motion.linear() * before;
    std::vector<double> off;
    for (const Pair& p : pairs) off.push_back((motion * p.before - p.now).norm());
    std::vector<double> sorted = off;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double most = std::max(0.25 * kStandsStill, 2 * sorted[sorted.size() / 2]);
    std::vector<Pair> kept;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (off[i] <= most) kept.push_back(pairs[i]);
    pairs = std::move(kept);
  }
  return motion;
}

}  // namespace

void Tracker::follow(PerceiveResult& frame) {
  Tracker next = *this;  // what is thrown on the way leaves this as it was
  next.follow_planes(frame);
  next.follow_spaces(frame);
  *this = std::move(next);
}

std::vector<Model> Tracker::planes() const {
  std::vector<Model> seeds;
  for (const Plane& plane : planes_)
    if (plane.missed <= kSeeded) seeds.push_back(plane.model);
  return seeds;
}

void Tracker::follow_planes(PerceiveResult& frame) {
  std::vector<double> costs;
  for (const Model& model : frame.fit.models)
    for (const Plane& plane : planes_) {
      // Where the camera rises or sinks steadily, the planes do the opposite; where it does not, they stay.
      costs.push_back(unlikely(plane) + std::min(cost_of(moved(plane.model, motion_), model), cost_of(plane.model, model)));
    }
  const auto chosen = assign(costs, planes_.size(), kGate + kMostUnlikely);
  for (Plane& plane : planes_) ++plane.missed;
  for (std::size_t m = 0; m < frame.fit.models.size(); ++m) {
    Model& model = frame.fit.models[m];
    const int at = chosen.empty() ? -1 : chosen[m];
    if (at < 0) planes_.push_back({next_plane_++, {}, 0, 0});
    Plane& plane = at < 0 ? planes_.back() : planes_[static_cast<std::size_t>(at)];
    model.id = plane.id;
    plane.model = model;
    plane.missed = 0;
    plane.seen = std::min(plane.seen + 1, kSettled);
  }
  std::erase_if(planes_, [](const Plane& plane) { return plane.missed > kRemembered; });
}

void Tracker::follow_spaces(PerceiveResult& frame) {
  std::vector<double> costs;
  for (const SpaceOfInterest& soi : frame.sois)
    for (const Space& space : spaces_) {
      const double reach = std::clamp(kReachOfRadius * (soi.radius + space.radius), kLeastReach, kMostReach);
      const double off = (soi.centre - motion_ * space.centre).norm() / reach;
      const double size = std::abs(std::log(soi.radius / space.radius)) / std::log(kSizeRatio);
      // Both have an edge of their own; within them, a thing is rather where it was than as large as it was.
      costs.push_back(off < 1 && size < 1 ? off + kSizeWeight * size + unlikely(space) : std::numeric_limits<double>::infinity());
    }
  const auto chosen = assign(costs, spaces_.size(), kGate + kSizeWeight + kMostUnlikely);
  std::vector<int> track_of(frame.sois.size(), -1);
  std::copy(chosen.begin(), chosen.end(), track_of.begin());
  estimate_motion(frame, track_of);
  for (Space& space : spaces_) {
    space.centre = motion_ * space.centre;  // what is not seen moves with the rest
    ++space.missed;
  }
  for (std::size_t k = 0; k < frame.sois.size(); ++k) {
    SpaceOfInterest& soi = frame.sois[k];
    if (track_of[k] < 0) spaces_.push_back({next_space_++, soi.centre, soi.radius, 0, 0});
    Space& space = track_of[k] < 0 ? spaces_.back() : spaces_[static_cast<std::size_t>(track_of[k])];
    soi.id = space.id;
    space.centre = soi.centre;
    space.radius += kNewRadius * (soi.radius - space.radius);
    space.missed = 0;
    space.seen = std::min(space.seen + 1, kSettled);
  }
  std::erase_if(spaces_, [](const Space& space) { return space.missed > kRemembered; });
  if (spaces_.size() <= kMostSpaces) return;
  std::stable_sort(spaces_.begin(), spaces_.end(), [](const Space& a, const Space& b) { return a.missed < b.missed; });
  spaces_.resize(kMostSpaces);
}

void Tracker::estimate_motion(const PerceiveResult& frame, const std::vector<int>& track_of) {
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < track_of.size(); ++k) {
    if (track_of[k] < 0) continue;
    const Space& space = spaces_[static_cast<std::size_t>(track_of[k])];
    if (space.missed == 0) pairs.push_back({space.centre, frame.sois[k].centre});
  }
  motion_ = common_motion(std::move(pairs), frame.up);
}

}  // namespace swarmfit::perception
