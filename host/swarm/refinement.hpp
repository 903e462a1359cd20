// Refinement of models on their own inliers, one by one and all together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// The largest, or 0 where there is none.
float widest_of(std::span<const float> allowed) noexcept;

/// What refinement works on: all of `points`, or a part of them.
struct Ground {
  kernels::FitnessEvaluator& evaluator;
  const models::ModelSpace& space;
  const models::WorkingPoints& points;
  float tau;  ///< [data unit]
  const Subset* part = nullptr;
  float corner = 0.1F;                  ///< of tau: below this a residual weighs as in least squares, so that none weighs infinitely
  std::span<const float> allowed = {};  ///< tau of each of the ground's points [data unit]; empty: tau for all
  float widest = widest_of(allowed);    ///< the largest of them

  /// The same for a model of another kind.
  Ground of(const models::ModelSpace& other) const noexcept { return {evaluator, other, points, tau, part, corner, allowed, widest}; }
  /// From now on each point may be off by its own.
  void allow(std::span<const float> each) noexcept {
    allowed = each;
    widest = widest_of(each);
  }
  /// What the k-th point may be off.
  float allowed_at(std::size_t k) const noexcept { return allowed.empty() ? tau : allowed[k]; }
  /// Which points speak for a model, under `caps` or, where these are empty, under what the points may be off.
  kernels::Weighing weighing(std::span<const float> caps, float corner_of_tau) const;
  std::size_t size() const noexcept { return part != nullptr ? part->index().size() : points.size(); }
  kernels::PointsView view() const noexcept { return part != nullptr ? part->view() : points.view(); }
  /// Input index of the k-th point.
  std::uint32_t index(std::size_t k) const noexcept { return part != nullptr ? part->index()[k] : static_cast<std::uint32_t>(k); }
};

/// The caps of points that nothing explains: what each may be off, 0 where it is not finite. One for each of the cloud.
void cap_all(const Ground& ground, std::vector<float>& caps);

/// Of refinement, where there is no cause for fewer.
inline constexpr int kMostRounds = 8;

/// Models as kernels take them.
class ModelRows {
 public:
  ModelRows(const models::Frame& frame, std::size_t most);
  /// `most` times at most.
  void add(const models::ModelSpace& space, const models::Position& theta);
  std::span<const kernels::ModelView> views() const noexcept { return views_; }
  /// In the data's frame and unit.
  const models::Position& parameters(std::size_t m) const noexcept { return parameters_[m]; }

 private:
  const models::Frame& frame_;
  kernels::Reused<models::Position> parameters_;
  kernels::Reused<kernels::ModelView> views_;
};

/// Labels beyond `last` are of models that are not in the result: nobody's.
void forget_beyond(std::size_t last, std::span<std::uint16_t> labels) noexcept;

/// Where a distance is less, it takes the place of what is there; NaN is less than nothing.
void take_nearer(std::span<const float> distances, std::span<float> least);

/// What the ground's points within tau of a model and, where there are caps, within their cap say of it, weighted so that least squares
/// becomes least absolute deviations, which is what the truncated L1 loss asks of them. `distances` is empty or one a point.
Expected<kernels::Evidence> weigh(const Ground& ground, const models::Position& theta, std::span<const float> caps,
                                  std::span<float> distances);

/// Distances of a run of the ground's points, from `first` on, to a model. Runs that begin at a multiple of a thousand and twenty-four are
/// told what a pass over all points would tell.
Expected<> tell_distances(const Ground& ground, const models::Position& theta, std::size_t first, std::span<float> distances);

/// The same of each of several models, all points within tau.
Expected<kernels::Reused<kernels::Evidence>> weigh_all(const Ground& ground, std::span<const kernels::ModelView> models);

/// The least-squares model of those points; false if they do not determine one. `distances` are those to theta.
bool refine(const Ground& ground, const kernels::Evidence& evidence, std::span<const float> caps, std::span<const float> distances,
            models::Position& theta);

/// Least absolute deviations, by reweighting, on the points that are not better explained already (distance below their cap), repeated
/// while the truncated loss falls, `rounds` times at most. Returns the loss of theta; it never rises. `distances`, where not null, gets
/// those to the outcome.
Expected<double> refine_one(const Ground& ground, Loss loss, std::span<const float> caps, models::Position& theta, int rounds = kMostRounds,
                            std::vector<float>* distances = nullptr);

/// Distances of the ground's points to each of several models, of whatever kinds; NaN where a point is not finite.
Expected<kernels::Reused<kernels::Reused<float>>> measure(const Ground& ground, std::span<const models::Placed> models);

/// How far each of the ground's points is from the nearest of several models and from the next.
class TwoNearest {
 public:
  /// Models of whatever kinds.
  static Expected<TwoNearest> of(const Ground& ground, std::span<const models::Placed> models);

  /// What all models but one leave of each point: its tau, or the distance to the nearest of them; 0 where a point is not finite.
  void left_by_others(const Ground& ground, std::size_t model, std::vector<float>& caps) const;

 private:
  void meet(std::uint32_t model, std::span<const float> distances, std::size_t first, std::size_t last);

  kernels::Reused<float> nearest_, next_;  // infinite where a point is not finite
  kernels::Reused<std::uint32_t> whose_;   // the nearest
};

/// Energy of all models together: sum over points of min(tau, distance to the nearest model) [data unit].
Expected<double> joint_energy(const Ground& ground, std::span<const models::Placed> models);

/// Refits every model to the points within tau of it while the joint energy falls; it never rises. Returns the energy.
Expected<double> refine_jointly(const Ground& ground, std::vector<models::Placed>& models, int rounds = kMostRounds);

/// For each model, the points within tau of it and of no other: what would be lost without it.
Expected<kernels::Reused<std::size_t>> unique_support(const Ground& ground, std::span<const models::Placed> models);

}  // namespace swarmfit::swarm
