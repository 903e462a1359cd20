// The joint end: points are shared out among the models found, neighbours preferring one owner, and models are refitted to what they own.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/common/graph_cut.hpp"
#include "host/models/neighbours.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit::swarm {

/// Energy of a labelling l and models theta (PEaRL; Isack and Boykov 2012):
///
///   E = sum_i D_i(l_i) + smoothness sum_(i,j) V(l_i, l_j) + model |{l_i}|,  D_i(k) = d_ik / tau_i where d_ik <= 2 tau_i, D_i(0) = 1,
///   V(k, l) = [k != l], half that where one of them is 0
///
/// Alternates labels (alpha-expansion) and least squares on each model's own points, and drops a model where that saves more than it
/// explains; the energy never rises. Labels: 0 none, k the k-th of `models`, one a point of the cloud.
class Labelling {
 public:
  /// `part` must hold every finite point of the cloud.
  Labelling(const Ground& ground, const Subset& part, const models::Neighbours& neighbours, const LabelPrices& prices);

  /// Shares the points out among `models` and refits these.
  Expected<> start(std::span<const models::Position> models);
  /// Takes in those of the proposals that lower the energy; true if there were any.
  Expected<bool> offer(std::span<const models::Position> proposals);
  /// Drops models while that lowers the energy.
  Expected<> drop();

  const std::vector<models::Position>& models() const noexcept { return state_.models; }
  /// What each point of the cloud costs as things stand, at most tau [data unit]; tau where no model owns it, 0 where it is not finite.
  void costs(std::span<float> costs) const;
  /// For each model its place in the list given to start, or kJoined for a proposal.
  static constexpr std::size_t kJoined = static_cast<std::size_t>(-1);
  const std::vector<std::size_t>& kept() const noexcept { return kept_; }
  double energy() const noexcept { return state_.energy; }
  void write(std::span<std::uint16_t> labels) const;

 private:
  struct State {
    std::vector<models::Position> models;
    std::vector<std::vector<float>> distances;  // of each model, one a point of the part
    std::vector<std::uint64_t> fitted;          // of each model, what tells the points that it was last fitted to, and how often; 0 none
    std::vector<std::uint16_t> labels;          // one a point of the part
    double energy = 0;
  };

  /// Of each model to each point of the part.
  Expected<std::vector<std::vector<float>>> measure(std::span<const models::Position> models) const;
  /// The labels of the state's models, from those it has where they may stay; and the energy.
  void label(State& state);
  Expected<bool> refit(State& state);
  Expected<bool> drop_one();
  Expected<bool> try_one(const models::Position& proposal, std::span<const float> distances);
  double cost(std::size_t point) const;
  /// How much more alike neighbours are than chance would have it, in [0, 1], over the edges at points that models own.
  double coherence() const;
  /// Labels and models in turn while the energy falls, or until it is found above `hopeless`.
  Expected<> alternate(State& state, double hopeless = std::numeric_limits<double>::infinity());
  /// What each proposal would save of what the points cost as things stand, in units of tau.
  void weigh_gains(std::span<const std::vector<float>> distances, std::vector<double>& gains) const;

  const Ground& ground_;
  const Subset& part_;
  LabelPrices prices_;
  std::vector<std::pair<std::pair<int, int>, int>> edges_;  // two points, and how many of them ask for the other
  common::PottsEnergy potts_;                               // its edges are those of `edges_` at a price of `potts_smoothness_`
  double potts_smoothness_ = -1;
  State state_;
  std::vector<std::size_t> kept_;
};

}  // namespace swarmfit::swarm
