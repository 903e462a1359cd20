// Over frames of a stream: which plane and which space of interest is the one that was seen before.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <swarmfit/perception.hpp>

namespace swarmfit::perception {

/// Gives planes and SOIs ids that stay with them. What is out of sight is remembered for a while, so that it comes back as itself; an id
/// is never given twice. Memory is bounded by what is in view and what was lately.
class Tracker {
 public:
  /// Sets `id` of the frame's models and SOIs. The frame's `up` is its vertical.
  void follow(PerceiveResult& frame);
  /// The planes where they were seen last, those out of sight for a moment included: seeds of the next frame's swarm.
  std::vector<Model> planes() const;

 private:
  struct Plane {
    std::uint64_t id = 0;
    Model model;
    int missed = 0;  // frames since it was seen
    int seen = 0;    // frames it was seen in, up to a bound
  };
  struct Space {
    std::uint64_t id = 0;
    Eigen::Vector3d centre;  // in the frame last looked at [m]
    double radius = 0;
    int missed = 0, seen = 0;
  };
  void follow_planes(PerceiveResult& frame);
  void follow_spaces(PerceiveResult& frame);
  void estimate_motion(const PerceiveResult& frame, const std::vector<int>& track_of);

  std::vector<Plane> planes_;
  std::vector<Space> spaces_;
  Eigen::Isometry3d motion_ = Eigen::Isometry3d::Identity();  // of what stands still in the camera's frame, from one frame to the next
  std::uint64_t next_plane_ = 1, next_space_ = 1;
};

}  // namespace swarmfit::perception
