// What candidates of different kinds are worth beside each other: by what they save, and by how their points lie along them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/swarm/candidates.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"

namespace swarmfit::swarm {

class Swarm;

class Worth {
 public:
  Worth(const Problem& problem, const Unexplained& left) : problem_(problem), left_(left) {}

  /// W of docs/method.md#several-kinds-hostswarmcontestcpp, in points explained.
  double of(const Candidate& candidate) const;
  /// The same of a model of so much freedom that saves so much [data unit].
  double of(double saved, int freedom) const;
  /// Sum over points of what a model saves [data unit].
  double bare_saving(std::span<const float> caps, std::span<const float> distances) const;
  /// Share of a model's points whose surface lies along it; 1 where normals are not known.
  double agreement(std::size_t kind, const models::Position& theta, std::span<const float> caps, std::span<const float> distances) const;
  /// Share of a model's points that lie along it and in the inner half of its slab.
  double gathered(const Candidate& candidate) const;
  /// Is a curved model made of what lies here and there?
  bool is_strewn(const Candidate& candidate) const;
  /// Do a plane's points not bend away from it, towards its rim to the other side than in its middle, and does their surface not go on
  /// beside it? Then a curved model explains them hardly better, and would have to clearly.
  bool lies_flat(const Candidate& candidate) const;
  /// Are neighbours off a cylinder to the same side, as those of a box about its edges and its faces are?
  bool is_cornered(const Candidate& candidate) const;
  /// Of what the particles of a swarm know, what saves most of the points that lie along it: fitness knows no normals.
  Expected<> choose(const Swarm& swarm, Candidate& candidate) const;

 private:
  /// The points of a surface have each other for neighbours; what is left here and there of several lies among others' points.
  /// Share of the neighbours of its points that are its own, times that of the points that lie along it.
  double held(const Candidate& candidate) const;
  /// What a model saves of the part's points, in thresholds, times agreement().
  double saving_along(std::size_t kind, const models::Position& theta, std::span<const float> distances) const;

  const Problem& problem_;
  const Unexplained& left_;
};

}  // namespace swarmfit::swarm
