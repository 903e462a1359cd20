// Algorithm 2 of Zhou et al. 2010 and what makes it better: one model after another until none pays for itself.
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit::swarm {

class Labelling;
class Swarm;

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
  /// `points`: the whole cloud, or a thinned one of the size that the settings were resolved for. `part` is what samples are drawn from, and
  /// where the settings say so what swarms search. `evaluator` is given what is searched.
  MultiModel(kernels::FitnessEvaluator& evaluator, const models::ModelSpace& space, const models::WorkingPoints& points, const Part& part,
             const Settings& settings, std::uint64_t seed, Limits limits);

  /// Fills models, as far as these points tell, stop_reason and the counts of the result. The rest is for settle().
  Expected<> run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result);
  /// Positions of the result's models in the frame of the points.
  const std::vector<models::Position>& found() const noexcept { return found_; }
  /// Labels of the points where they were shared out jointly, with an eye to their neighbours; else empty, and the nearest model owns each.
  const std::vector<std::uint16_t>& labels() const noexcept { return labels_; }

 private:
  enum class Outcome { found, unpaid, complete, interrupted };

  Expected<Outcome> search(std::uint32_t round, std::span<const models::Position> seeds, models::Position& theta, double& loss);
  /// Flies one swarm over the caps as they are; false if it ended early. Samples are of points whose cap is at least `alive`.
  Expected<bool> fly(Swarm& swarm, std::uint32_t round, std::span<const models::Position> seeds, float alive);
  Expected<> refine(models::Position& theta, double& loss);
  Expected<bool> accept(const models::Position& theta, double loss, const ModelCallback& on_model, FitResult& result);
  Expected<> deflate();
  Expected<> finish(FitResult& result);
  Expected<> polish();
  Expected<> share_out(FitResult& result);
  Expected<> search_further(Labelling& labelling);
  Expected<> drop_unpaid(FitResult& result);
  std::optional<std::string> interrupted() const;
  void restore_caps();
  Expected<> show_caps();
  void count_effort(FitResult& result) const;
  double elapsed_ms() const;
  double loss_of_nothing() const;
  bool shares_out() const noexcept;
  int full_rounds() const noexcept;  ///< of refinement on all points
  const Ground& searched() const noexcept { return part_searched_ ? part_ground_ : ground_; }

  kernels::FitnessEvaluator& evaluator_;
  const models::ModelSpace& space_;
  const models::WorkingPoints& points_;
  const Settings& settings_;
  Random random_;
  Limits limits_;
  const Subset& part_;
  const models::Neighbours& neighbours_;
  const bool part_searched_;
  Landscape landscape_;  // of the points that are searched
  float tau_;
  Ground ground_, part_ground_;                      // all points, and the part
  std::vector<float> caps_, part_caps_, distances_;  // one a point; caps are what is left to explain, in both kinds of deflation
  std::vector<float> nearest_;                       // one a point: how far the nearest found model is; empty until there is one
  Support support_;                                  // of the last candidate
  std::vector<models::Position> found_;
  std::vector<models::Position> proposals_;  // what the joint end may add to them
  std::vector<std::uint16_t> labels_;
  double scale_ = 0;  // loss of a model that explains nothing
  std::size_t steps_ = 0;
  std::uint32_t round_ = 0;  // swarms flown so far
  std::string stop_reason_;
};

}  // namespace swarmfit::swarm
