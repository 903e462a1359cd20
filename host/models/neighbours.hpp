// Who lies next to whom: the nearest neighbours of points, for samples, normals and smooth labels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/models/working_points.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::models {

/// The nearest others of each of `candidates` among them, by a kd-tree over all columns of the working frame. Ties go to the lower place.
class Neighbours {
 public:
  Neighbours() = default;
  /// `candidates`: input indices of finite points. `count`: neighbours a point, fewer where there are fewer candidates. `workers`, here and
  /// below, may be null: whose threads share the work. `asked`: not 0 where a candidate's neighbours are looked up; one that is not asked
  /// for is given itself. Empty: all are.
  Neighbours(const WorkingPoints& points, std::span<const std::uint32_t> candidates, std::size_t count,
             kernels::FitnessEvaluator* workers = nullptr, std::span<const std::uint8_t> asked = {});

  bool empty() const noexcept { return nearest_.empty(); }
  std::size_t count() const noexcept { return count_; }
  /// Places in `candidates` of the neighbours of the one at `place`, nearest first.
  std::span<const std::uint32_t> of(std::size_t place) const noexcept { return std::span(nearest_).subspan(place * count_, count_); }

 private:
  std::size_t count_ = 0;
  kernels::Reused<std::uint32_t> nearest_;
};

/// Unit normals of points in space, one a candidate: of the plane through it and its neighbours; zero where those have no one plane, and of
/// those that are not `asked` for.
std::vector<Eigen::Vector3f> estimate_normals(const WorkingPoints& points, std::span<const std::uint32_t> candidates,
                                              const Neighbours& neighbours, kernels::FitnessEvaluator* workers = nullptr,
                                              std::span<const std::uint8_t> asked = {});

}  // namespace swarmfit::models
