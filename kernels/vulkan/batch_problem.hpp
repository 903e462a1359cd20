// One problem of a batch on the host: its points and caps as the device is to hold them, and where it holds them.
#pragma once

#include <vector>

#include "kernels/fitness_evaluator.hpp"
#include "kernels/vulkan/stored_points.hpp"

namespace swarmfit::kernels::vulkan {

class BatchProblem {
 public:
  explicit BatchProblem(bool sorted) : points_(sorted) {}

  /// Sets all caps to 0. The arguments were checked.
  void set_points(const DeviceTraits& device, const PointsView& points);
  void set_caps(std::span<const float> caps);

  /// 0 until points are set, and after that has failed.
  int dimension() const noexcept { return usable_ ? points_.dimension() : 0; }
  const StoredPoints& points() const noexcept { return points_; }
  std::uint32_t chunks() const noexcept { return chunks_; }
  std::uint32_t stride() const noexcept { return chunks_ * points_.shape().points(); }
  /// Columns, then caps, each padded to whole chunks.
  std::size_t floats() const noexcept { return values_.size(); }

  /// How many may be on the device, from `place` on. A new place is to be written anew.
  std::size_t room() const noexcept { return room_; }
  std::size_t place() const noexcept { return place_; }
  void settle(std::size_t place, std::size_t room) noexcept;

  /// Copies to the device's memory what has changed since the last time.
  void write(std::span<float> device);

  Effort effort;

 private:
  std::size_t caps_from() const noexcept { return static_cast<std::size_t>(points_.dimension()) * stride(); }

  bool usable_ = false;
  StoredPoints points_;
  std::uint32_t chunks_ = 0;
  std::vector<float> values_;
  std::size_t place_ = 0, room_ = 0;
  bool new_points_ = false, new_caps_ = false;
};

}  // namespace swarmfit::kernels::vulkan
