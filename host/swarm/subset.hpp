// Parts of the cloud that stand for the whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/models/neighbours.hpp"
#include "host/models/working_points.hpp"
#include "host/swarm/random.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// Input indices of at most `size` finite points, in input order: one drawn from each of equal runs, so that a scan or an image is covered
/// evenly. All finite points where there are no more. Parts of different `number` are drawn independently. `workers`, here and below, may
/// be null: whose threads share the work.
inline constexpr std::uint32_t kSearchedPart = 0, kThinnedPart = 1;
kernels::Reused<std::uint32_t> draw_part(const models::WorkingPoints& points, const Random& random, std::uint32_t number, std::size_t size,
                                         kernels::FitnessEvaluator* workers = nullptr);

/// The same of a cloud whose points are worth the less the more `spread`, one a point and >= 1, says their noise is: each is drawn with a
/// probability that falls as 1 / spread, so that what a model saves on them is, on average, counted in units of each point's own noise.
/// `size` of them on average, each by itself.
kernels::Reused<std::uint32_t> draw_steady_part(const models::WorkingPoints& points, const Random& random, std::uint32_t number,
                                                std::size_t size, std::span<const float> spread);

/// Rows of a cloud, copied as they are: a cloud of its own.
class Rows {
 public:
  Rows(const kernels::PointsView& points, std::span<const std::uint32_t> index, kernels::FitnessEvaluator* workers = nullptr);

  /// A view of memory that lives as long as this.
  PointsView view() const noexcept;

 private:
  PointsView::Scalar scalar_;
  int dimension_;
  std::size_t width_;  // bytes of a row
  kernels::Reused<std::byte> bytes_;
};

/// What a swarm searches on while it looks around: a part of the cloud in Morton order, in which neighbours are neighbours in space.
class Subset {
 public:
  /// Of the points `drawn`.
  Subset(const models::WorkingPoints& points, std::span<const std::uint32_t> drawn, kernels::FitnessEvaluator* workers = nullptr);

  /// Input indices, in Morton order.
  std::span<const std::uint32_t> index() const noexcept { return index_; }
  /// The coordinates of these points; a view of memory that lives as long as this.
  kernels::PointsView view() const noexcept {
    kernels::PointsView view = models::to_kernel(rows_.view());
    view.ordered = true;
    return view;
  }
  /// values[k] = all[index[k]].
  void gather(std::span<const float> all, std::vector<float>& values) const;

 private:
  kernels::Reused<std::uint32_t> index_;
  Rows rows_;
};

/// The part of a cloud that is looked at closely.
struct Part {
  Subset points;
  models::Neighbours neighbours;  ///< of its points among themselves; empty where nothing asks for them
};

/// A part of `size` points at most, its neighbourhoods not known yet. `spread` is empty or as for draw_steady_part().
Part part_to_look_at(const models::WorkingPoints& points, const Random& random, std::size_t size,
                     kernels::FitnessEvaluator* workers = nullptr, std::span<const float> spread = {});
/// Its neighbourhoods, where the kind has use for them; gives `points` the normals of the part where the kind looks at them. `left`: what
/// is left of each of the part's points; those of which nothing is are left out. Empty: none are.
void learn_neighbourhoods(Part& part, models::WorkingPoints& points, const models::ModelSpace& space,
                          kernels::FitnessEvaluator* workers = nullptr, std::span<const float> left = {});
/// Both.
Part look_closely(models::WorkingPoints& points, const models::ModelSpace& space, const Random& random, std::size_t size,
                  kernels::FitnessEvaluator* workers = nullptr, std::span<const float> spread = {});

}  // namespace swarmfit::swarm
