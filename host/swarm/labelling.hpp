// The joint end: points are shared out among the models found, neighbours preferring one owner, and models are refitted to what they own.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/models/neighbours.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit::swarm {

/// Energy of a labelling l and models theta (PEaRL; Isack and Boykov 2012):
///
///   E = sum_i D_i(l_i) + smoothness sum_(i,j) [l_i != l_j] + model |{l_i}|,  D_i(k) = d_ik / tau_i where d_ik <= 2 tau_i, D_i(0) = 1
///
/// Alternates labels (alpha-expansion) and least squares on each model's own points, and drops a model where that saves more than it
/// explains; the energy never rises. Labels: 0 none, k the k-th of `models`, one a point of the cloud.
class Labelling {
 public:
  /// `part` must hold every finite point of the cloud.
  Labelling(const Ground& ground, const Subset& part, const models::Neighbours& neighbours, const LabelPrices& prices);

  /// `proposals`: positions that might be models as well; they join where that lowers the energy.
  Expected<> settle(std::vector<models::Position>& models, std::span<const models::Position> proposals);
  /// For each model that came out its place in the list given to settle, or kJoined for a proposal.
  static constexpr std::size_t kJoined = static_cast<std::size_t>(-1);
  const std::vector<std::size_t>& kept() const noexcept { return kept_; }
  double energy() const noexcept { return energy_; }
  void write(std::span<std::uint16_t> labels) const;

 private:
  struct State {
    std::vector<models::Position> models;
    std::vector<std::vector<float>> distances;  // of each model, one a point of the part
    std::vector<std::uint16_t> labels;          // one a point of the part
    double energy = 0;
  };

  /// Of each model to each point of the part.
  Expected<std::vector<std::vector<float>>> measure(std::span<const models::Position> models) const;
  void label(State& state) const;
  Expected<bool> refit(State& state) const;
  Expected<bool> drop_one(State& state);
  Expected<> add(State& state, std::span<const models::Position> proposals);
  Expected<bool> try_one(State& state, const models::Position& proposal, std::span<const float> distances);
  std::vector<double> costs(const State& state) const;
  Expected<> alternate(State& state) const;

  const Ground& ground_;
  const Subset& part_;
  LabelPrices prices_;
  std::vector<std::pair<int, int>> edges_;  // each pair once for each of the two that asks for it
  std::vector<std::size_t> kept_;
  std::vector<std::uint16_t> labels_;
  double energy_ = 0;
};

}  // namespace swarmfit::swarm
