// What one search is over: kinds of model, points, and what follows from these. Nothing here changes while it runs, but that neighbours and
// normals may be learnt once, before the first swarm that asks for them.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host/models/model_space.hpp"
#include "host/models/neighbours.hpp"
#include "host/models/working_points.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// With more points, what is gained by looking closer is nothing beside what they say together.
inline constexpr std::size_t kFewPoints = 2048;

/// Side of the square or cube over which points strewn evenly are as spread as those of a cloud are [working frame].
inline double even_side(int dimension) { return std::sqrt(12.0 / dimension); }

/// What lies between two corners of the plane.
struct Box {
  Eigen::Vector2d low{0, 0}, high{0, 0};

  double area() const noexcept { return (high - low).prod(); }
};

struct Problem {
  /// `points`: the whole cloud, or a thinned one of the size that the settings of `kinds` were resolved for. `part` is what samples are
  /// drawn from, and where the settings say so what swarms search. `kinds`, `points` and `part` must outlive this. `spread`: how many times
  /// the threshold each point may be off (noise_model.hpp); empty: once.
  Problem(kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, const models::WorkingPoints& points, const Part& part,
          std::uint64_t seed, std::span<const float> spread);
  Problem(const Problem&) = delete;  // the grounds look into it
  Problem& operator=(const Problem&) = delete;

  const models::ModelSpace& space(std::size_t kind) const noexcept { return *kinds[kind].space; }
  Ground whole(std::size_t kind) const noexcept { return ground.of(space(kind)); }
  /// What swarms see.
  const Ground& searched() const noexcept { return part_searched ? part_ground : ground; }

  /// Distances or caps, one a point, in measures that make the threshold of each tau; in `room` where they are not so already.
  std::span<const float> levelled(std::span<const float> values, std::vector<float>& room) const;
  /// The same of values of some points, by thresholds of those.
  std::span<const float> levelled(std::span<const float> values, std::vector<float>& room, std::span<const float> of_those) const;

  /// Are a candidate's distances kept? Of very many points they would be most of the memory; they are told anew, a run at a time.
  bool lists_distances() const noexcept;
  /// Of refinement on all points.
  int full_rounds() const noexcept;
  /// May a model of this kind pay with points that a found one explains less well? Few points are labelled with an eye to their
  /// neighbours, and where each point has a threshold of its own the noise's tails are wide. Of several kinds only what is curved may, in
  /// space: a plane goes on where its surface ends, and cuts through what is round.
  bool may_share(std::size_t kind) const noexcept;
  bool any_shares() const noexcept { return kinds.size() == 1 ? may_share(0) : allowed.empty() && points.dimension() == 3; }

  /// Is there a flat kind that was not asked for? It is the last.
  bool hides_flat() const noexcept { return kinds.back().hidden && !is_curved(kinds.back().space->type()); }
  /// What a curved kind is with a large radius; kinds.size() where there is none.
  std::size_t flat_kind(std::size_t curved) const noexcept;

  /// Has a model no say in what is nearer to another, be it hidden?
  bool shares_points(bool any_hidden) const noexcept { return asked > 1 || any_hidden; }
  /// Is what is nearer to a hidden model nobody's in the result? In the plane all outliers are near some line.
  bool hidden_owns() const noexcept { return points.dimension() == 3; }

  /// Does the joint end share points out among models with an eye to their neighbours, as those of correspondences?
  bool shares_out() const noexcept { return settings.joint && !part_searched && settings.prices.smoothness > 0; }
  /// Are points so few that each is looked at with those about it?
  bool labels_locally() const noexcept { return settings.sharpen && !part_searched && points.finite_count() <= kFewPoints; }
  /// Do models of this kind end at the least absolute deviations themselves?
  bool sharpens(const models::ModelSpace& of) const noexcept;
  /// Corner of the loss that models of this kind are refined with last, of tau: 0 for the least absolute deviations, 1 for least squares.
  float corner(const models::ModelSpace& of) const noexcept;

  /// Share of points strewn evenly over the cloud that would be within tau of a line or circle; 0 of other kinds, and where each point has
  /// a threshold of its own.
  double strewn_along(std::size_t kind, const models::Position& theta) const;

  kernels::FitnessEvaluator& evaluator;
  std::span<const Kind> kinds;
  std::size_t asked;  ///< the first so many of them; the rest are hidden
  const models::WorkingPoints& points;
  const Settings& settings;  ///< of the first kind; for what all kinds share
  Random random;
  const Subset& part;
  const models::Neighbours& neighbours;  ///< of the part's points
  bool part_searched;
  float tau;                                     ///< [data unit]
  kernels::Reused<float> allowed, part_allowed;  ///< tau of each point, and of the part's; empty: tau for all
  Ground ground, part_ground;                    ///< all points, and the part; as the first kind has it
  Box box;                                       ///< about the finite points, of two columns [working frame]
};

}  // namespace swarmfit::swarm
