// A part of the cloud that stands for the whole while a swarm looks around.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/working_points.hpp"
#include "host/swarm/random.hpp"

namespace swarmfit::swarm {

/// At most `size` finite points, spread evenly over the input's order (one drawn from each of equal runs, so that a scan or an image is
/// covered evenly) and kept in Morton order, in which neighbours are neighbours in space. The whole cloud where it is no larger.
class Subset {
 public:
  Subset(const models::WorkingPoints& points, const Random& random, std::size_t size);

  /// Input indices, in Morton order.
  std::span<const std::uint32_t> index() const noexcept { return index_; }
  /// The coordinates of these points, row after row; a view of memory that lives as long as this.
  kernels::PointsView view() const noexcept;
  /// values[k] = all[index[k]].
  void gather(std::span<const float> all, std::vector<float>& values) const;

 private:
  int dimension_;
  std::vector<std::uint32_t> index_;
  std::vector<double> rows_;
};

}  // namespace swarmfit::swarm
