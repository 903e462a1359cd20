// One fit, from the caller's points to the result.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/working_points.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/pilot.hpp"
#include "host/swarm/subset.hpp"
#include "kernels/fitness_evaluator.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

class MultiModel;

/// Back ends of one thread each, for two searches side by side; made when they are first asked for.
class EvaluatorPair {
 public:
  /// Fails as the back end cpu does.
  Expected<> make();
  kernels::FitnessEvaluator& first() const noexcept { return *pair_[0]; }
  kernels::FitnessEvaluator& second() const noexcept { return *pair_[1]; }

 private:
  std::array<std::unique_ptr<kernels::FitnessEvaluator>, 2> pair_;
};

class FitCall {
 public:
  /// `options` are valid, and `kinds` what make_kinds() makes of them; their settings are resolved here. All else must outlive this.
  /// `observer` and `on_model` may be empty.
  FitCall(const FitOptions& options, std::shared_ptr<std::vector<Kind>> kinds, kernels::FitnessEvaluator& evaluator, EvaluatorPair& pair,
          const SwarmObserver& observer, const ModelCallback& on_model, Limits limits);

  /// A fit of one model of the first kind to a few made-up points, of which nothing stays but that code and memory have been touched.
  /// Models found: none of an own kind, for which nothing is made up. Fails as run() does.
  static Expected<std::size_t> rehearse(const FitOptions& options, kernels::FitnessEvaluator& evaluator, EvaluatorPair& pair);

  /// Fails with bad_input, backend_unavailable where it does not take so much work, and whatever the back end reports. All but the result's
  /// backend.
  Expected<FitResult> run(const PointsView& points, const std::vector<Model>& warm_start);

 private:
  /// What a search has come to, in the frame of the points that it was given.
  struct Found {
    kernels::Reused<models::Placed> models, hidden;
    kernels::Reused<float> corners;         ///< of the loss that each model was refined with, of tau
    kernels::Reused<std::uint16_t> labels;  ///< of these points, or empty
    bool shares_points = false;
    bool hidden_owns = false;
  };

  static Found found_by(const MultiModel& search);
  /// Looks at the points, and where they are many draws those that stand for them.
  Expected<> take(const PointsView& points);
  Expected<> thin();
  /// The part that is looked at closely, and what each point's noise is.
  Expected<> choose_part();
  /// Is that the search's to do, when it has taken the planes that stand out? An estimate of the threshold may ask for it before.
  bool looks_later() const;
  /// Given, or from the data; then some models are known.
  Expected<> settle_threshold(FitResult& result);
  Expected<Found> search(const std::vector<Model>& warm_start, FitResult& result);
  Expected<Found> search_twice(const std::vector<Model>& warm_start, FitResult& result);
  /// What was found meets all the points.
  Expected<> finish(Found found, FitResult& result);

  models::WorkingPoints& working() noexcept { return thin_rows_ ? thin_ : whole_; }
  const Settings& settings() const noexcept { return kinds_.front().settings; }
  Watch* watch() noexcept { return watch_.observer ? &watch_ : nullptr; }

  const FitOptions& options_;
  kernels::FitnessEvaluator& evaluator_;
  EvaluatorPair& pair_;
  const ModelCallback& on_model_;
  Watch watch_;
  Limits limits_;
  const std::shared_ptr<std::vector<Kind>> kept_kinds_;
  std::vector<Kind>& kinds_;
  models::WorkingPoints whole_, thin_;
  std::optional<Rows> thin_rows_;
  bool part_searched_ = false;
  double depth_ = 0;               // of the near end, where noise grows with it
  kernels::Reused<float> spread_;  // of the working points
  std::optional<Part> part_;
  std::vector<Known> known_;
  bool points_set_ = false;  // has the evaluator the searched points already?
};

}  // namespace swarmfit::swarm
