// The joint end: points are shared out among the models found, neighbours preferring one owner, and models are refitted to what they own.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/common/graph_cut.hpp"
#include "host/models/neighbours.hpp"
#include "host/swarm/distances.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// A number that tells a set of points from others (Fowler, Noll and Vo's hash); odd.
std::uint64_t mark_of(std::span<const std::uint32_t> points);

/// Energy of a labelling l and models theta (PEaRL; Isack and Boykov 2012):
///
///   E = sum_i D_i(l_i) + smoothness sum_(i,j) V(l_i, l_j) + model |{l_i}|,  D_i(k) = d_ik / tau where that is at most 2, D_i(0) = 1,
///   V(k, l) = [k != l], half that where one of them is 0
///
/// with d / tau bent to log(1 + d / (bend tau)) / log(1 + 1 / bend) where the prices ask for it. Where neighbours agree little smoothness
/// counts for less, and a model for more, if the prices say so: one that need not hold together explains strewn points more easily.
///
/// Alternates labels (alpha-expansion) and least squares on each model's own points, and drops a model where that saves more than it
/// explains; the energy never rises. Labels: 0 none, k the k-th of `models`, one a point of the cloud.
class Labelling {
 public:
  /// `part` must hold every finite point of the cloud.
  Labelling(const Ground& ground, const Subset& part, const models::Neighbours& neighbours, const LabelPrices& prices);

  /// No more models than that, from now on; 0: no bound.
  void bound(std::size_t most) noexcept { most_ = most; }
  /// Asked between attempts to lower the energy: true where there is no time for more. What is there then is valid.
  void stop_when(std::function<bool()> enough) { enough_ = std::move(enough); }
  /// Shares the points out among `models` and refits these.
  Expected<> start(std::span<const models::Position> models);
  /// Takes in those of the proposals that lower the energy; true if there were any.
  Expected<bool> offer(std::span<const models::Position> proposals);
  /// Other models take the place of all that are there, where these end at a lower energy; and each side's models are offered to the
  /// other's, beside them and in place of them.
  Expected<> contend(std::span<const models::Position> others);
  /// Drops models while that lowers the energy.
  Expected<> drop();

  // Moves of what is there, each made where it lowers the energy; true if it was. Proposals are models through samples of points that the
  // model, or the two, own. In labelling_moves.cpp.
  /// A proposal, fitted to what it wins of the others, takes the model's place.
  Expected<bool> replace(std::size_t model, std::span<const models::Position> proposals);
  /// A proposal takes some of the model's points, and both are fitted to theirs.
  Expected<bool> split(std::size_t model, std::span<const models::Position> proposals);
  /// A proposal, fitted to the points of both, takes their place.
  Expected<bool> join(std::size_t one, std::size_t other, std::span<const models::Position> proposals);
  /// Von Neumann's ratio of a model's residuals: half the mean square of what two neighbours of its points differ by, over the mean square
  /// of one. 1 of noise, less where a pattern is left; 1 where there is too little to tell.
  double evenness(std::size_t model) const;
  /// What ends of edges cost because one is this model's and the other that one's.
  double border(std::size_t one, std::size_t other) const;
  /// Marks the points of the cloud that a model owns with 1, and leaves the others as they are.
  void mark_owned(std::size_t model, std::span<float> marks) const;
  /// How much more alike neighbours are than chance would have it, in [0, 1], over the edges at points that models own.
  double coherence() const;
  /// A number that tells the set of a model's points from others.
  std::uint64_t owned_set(std::size_t model) const;

  std::span<const models::Position> models() const noexcept { return state_.models; }
  /// What each point of the cloud costs as things stand, at most tau [data unit]; tau where no model owns it, 0 where it is not finite.
  void costs(std::span<float> costs) const;
  /// For each model its place in the list given to start, or kJoined for a proposal.
  static constexpr std::size_t kJoined = static_cast<std::size_t>(-1);
  const std::vector<std::size_t>& kept() const noexcept { return kept_; }
  double energy() const noexcept { return state_.energy; }
  void write(std::span<std::uint16_t> labels) const;

 private:
  struct State {
    kernels::Reused<models::Position> models;
    Distances distances;                    // to the points of the part, as they count: bent
    kernels::Reused<std::uint64_t> fitted;  // of each model, what tells the points that it was last fitted to, and how often; 0 none
    kernels::Reused<std::uint16_t> labels;  // one a point of the part
    double energy = 0;
  };

  /// Of each model to each point of the part, bent.
  Expected<Distances> measure(std::span<const models::Position> models) const;
  /// Of what a distance counts as, where they are bent, the distance [data unit].
  float unbent(float cost) const;
  /// The labels of the state's models, from those it has where they may stay; and the energy. `only`: not empty where no other labels may
  /// be taken.
  void label(State& state, std::span<const std::uint16_t> only = {});
  Expected<bool> refit(State& state);
  Expected<bool> drop_one();
  Expected<bool> try_one(models::Position proposal, std::span<const float> distances);
  /// Fits a proposal to what it wins of what the points cost as things stand; what it then saves, in units of tau.
  Expected<double> fit_to_gain(models::Position& theta, kernels::Reused<float>& distances) const;
  double cost(std::size_t point) const;
  /// That of each point of the part [data unit].
  kernels::Reused<float> present_costs() const;
  bool full() const noexcept { return most_ > 0 && state_.models.size() >= most_; }
  /// Labels and models in turn while the energy falls, or until it is found above `hopeless`.
  Expected<> alternate(State& state, double hopeless = std::numeric_limits<double>::infinity());
  /// The state becomes `with`, labelled and fitted, where that lowers the energy.
  Expected<bool> adopt(State&& with, double hopeless = std::numeric_limits<double>::infinity());
  /// The same with a model more, the last, made out of nothing or of `parent`. Given up, before anything is fitted, where with the labels
  /// that it changes directly the energy is above the present one by `at_once` prices of a model.
  Expected<bool> adopt_one_more(State&& with, double at_once, std::optional<std::size_t> parent = std::nullopt);
  static void remove(State& state, std::size_t model);
  /// Input indices of a model's points.
  kernels::Reused<std::uint32_t> owned(std::size_t model) const;
  /// Tries a model on those points of the part that `takes` names, or some of them, if they are many; it stays where they do not
  /// determine one.
  template <class Takes>
  void fit_to(Takes&& takes, models::Position& theta) const;
  /// Proposals by their number, and what each would save of what the points cost as things stand, in units of tau.
  struct Offers {
    kernels::Reused<std::size_t> proposals;
    kernels::Reused<double> gains;
    Distances distances;
  };
  /// Those that would save enough to be tried.
  Expected<Offers> promising(std::span<const models::Position> proposals) const;
  void weigh_gains(Offers& offers) const;

  const Ground& ground_;
  const Subset& part_;
  LabelPrices prices_;
  float per_bend_ = 0, farthest_ = 0;  // log(1 + 1 / bend), and the farthest distance of a point that may be owned [tau], where they bend
  kernels::Reused<std::pair<std::pair<int, int>, int>> edges_;  // two points, and how many of them ask for the other
  common::PottsEnergy potts_;                                   // its edges are those of `edges_` at a price of `potts_smoothness_`
  double potts_smoothness_ = -1;
  State state_;
  std::vector<std::size_t> kept_;
  std::size_t most_ = 0;
  std::function<bool()> enough_ = [] { return false; };
};

}  // namespace swarmfit::swarm
