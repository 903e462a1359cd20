// The function that a swarm searches: the truncated loss under the current caps, deflated by Eq. (5) where that is asked for.
#pragma once

#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/settings.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// A kernels::Failure in the public words.
Error to_error(const kernels::Failure& failure);

/// What points strewn evenly over a box save along a curve through it.
struct Background {
  double per_length = 0;                  ///< fitness per length in the working frame; 0: chance is not asked
  Eigen::Vector2d low{0, 0}, high{0, 0};  ///< the box [working frame]
};

class Landscape {
 public:
  Landscape(kernels::FitnessEvaluator& evaluator, const models::ModelSpace& space, const models::Frame& frame, const Settings& settings)
      : evaluator_(evaluator), space_(space), frame_(frame), settings_(settings) {}

  /// Adds a found optimum to O of Eq. (5); without effect on the fitness under residual deflation, whose caps are the evaluator's.
  void deflate_around(const models::Position& optimum) { optima_.push_back(optimum); }

  /// From now on a fitness tells what a model saves beyond chance: without that a wide circle among outliers is as good as a small true
  /// one.
  void expect(const Background& background) { background_ = background; }

  /// fitness[j] of positions[j], exact where it is below bests[j]. Sizes must be equal.
  Expected<> fitness(std::span<const models::Position> positions, std::span<const double> bests, std::span<double> fitness);
  /// Truncated loss f of one position, not deflated.
  Expected<double> loss(const models::Position& theta);

 private:
  double deflation(const models::Position& theta) const;

  kernels::FitnessEvaluator& evaluator_;
  const models::ModelSpace& space_;
  const models::Frame& frame_;
  const Settings& settings_;
  Background background_;
  kernels::Reused<models::Position> optima_;
  kernels::Reused<double> parameters_, factor_, by_chance_;
  kernels::Reused<float> cutoffs_, costs_;
};

}  // namespace swarmfit::swarm
