// Algorithm 2 of Zhou et al. 2010 and what makes it better: one model after another until none pays for itself.
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit::swarm {

using Clock = std::chrono::steady_clock;

/// When to end early.
struct Limits {
  Clock::time_point start = Clock::now();
  double budget_ms = 0;
  std::stop_token stop;
  std::size_t max_models = 0;
};

class MultiModel {
 public:
  /// `evaluator` holds the points. `scout`, of the same kind, is given a part of them to search on where the settings say so and the cloud
  /// is larger; nullptr searches on all points.
  MultiModel(kernels::FitnessEvaluator& evaluator, kernels::FitnessEvaluator* scout, const models::ModelSpace& space,
             const models::WorkingPoints& points, const Settings& settings, std::uint64_t seed, Limits limits);

  /// Fills models, labels, stop_reason and the counts of the result.
  Expected<> run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result);

 private:
  enum class Outcome { found, unpaid, complete, interrupted };

  Expected<Outcome> search(std::uint32_t round, std::span<const models::Position> seeds, models::Position& theta, double& loss);
  Expected<bool> accept(const models::Position& theta, double loss, const ModelCallback& on_model, FitResult& result);
  Expected<> deflate(std::span<const float> distances);
  Expected<> finish(FitResult& result);
  Expected<> polish(const Ground& ground);
  Expected<> drop_unpaid(const Ground& ground, FitResult& result);
  Expected<> label(FitResult& result);
  Expected<> describe(FitResult& result);
  std::optional<std::string> interrupted() const;
  Expected<> set_caps(std::span<const float> caps);
  void count_effort(FitResult& result) const;
  Expected<> distances(const models::Position& theta);
  double elapsed_ms() const;
  int rounds() const noexcept;  ///< of refinement on all points
  double loss_of_nothing() const;

  kernels::FitnessEvaluator& evaluator_;
  kernels::FitnessEvaluator* scout_;  // null where the search is on all points
  const models::ModelSpace& space_;
  const models::WorkingPoints& points_;
  const Settings& settings_;
  Random random_;
  Limits limits_;
  Landscape landscape_, searched_;             // of all points, and of those that are searched on
  Subset subset_;                              // what samples are drawn from, and the scout's points
  std::vector<float> tau_, caps_, distances_;  // one a point; caps_ is what is left to explain, in both kinds of deflation
  std::vector<models::Position> found_;
  double scale_ = 0;  // loss of a model that explains nothing
  std::size_t steps_ = 0;
  std::string stop_reason_;
};

}  // namespace swarmfit::swarm
