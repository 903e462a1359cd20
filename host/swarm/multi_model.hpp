// Algorithm 2 of Zhou et al. 2010 and what makes it better: one model after another until none pays for itself.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/candidates.hpp"
#include "host/swarm/contest.hpp"
#include "host/swarm/pilot.hpp"
#include "host/swarm/polish.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/search.hpp"
#include "host/swarm/share_out.hpp"
#include "host/swarm/unexplained.hpp"
#include "host/swarm/worth.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// The search of one fit, or one of two.
class MultiModel {
 public:
  /// As Problem takes them; `evaluator` is given what is searched.
  MultiModel(kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, const models::WorkingPoints& points, const Part& part,
             std::uint64_t seed, Limits limits, std::span<const float> spread = {});

  /// Told of each step of each swarm; must outlive this. Null: nobody is.
  void watched_by(Watch* watch) noexcept { pilot_.watched_by(watch); }
  /// The evaluator has the points of this search already, from one before: setting them again would but sort them anew.
  void points_are_set() noexcept { points_set_ = true; }

  /// `learn` tells the neighbourhoods and normals of those of the part's points of which something is left; none were known so far. Planes
  /// that stand out are taken before it is called.
  void learn_after_planes(std::function<void(std::span<const float> left)> learn) { learn_ = std::move(learn); }

  /// Fills models, as far as these points tell, stop_reason and the counts of the result. The rest is for settle(). `known` are refined
  /// and taken, where they pay, before anything is searched; `warm_start` only tells the first swarms where to begin.
  Expected<> run(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result, std::span<const Known> known = {});
  // The same in two parts, for two searches of correspondences that end as one.
  /// All but the end.
  Expected<> look_for_models(const ModelCallback& on_model, const std::vector<Model>& warm_start, FitResult& result,
                             std::span<const Known> known = {});
  /// The end. `others` are what another search has come to, in the same frame; `effort` is that of its evaluator, where that is another.
  Expected<> conclude(const ModelCallback& on_model, FitResult& result, std::span<const models::Placed> others = {},
                      const kernels::Effort& effort = {});
  /// Of the evaluator, in this search.
  kernels::Effort effort() const noexcept;
  /// Has the caller said that there are models enough?
  bool stopped_by_caller() const noexcept { return stopped_by_caller_; }
  /// Makes this another search than one of the same seed.
  void draw_otherwise() noexcept { pilot_.draw_otherwise(); }

  const Problem& problem() const noexcept { return problem_; }
  /// The result's models in the frame of the points.
  const std::vector<models::Placed>& found() const noexcept { return found_; }
  /// Flat models that curved ones were taken for; not in the result.
  const std::vector<models::Placed>& hidden() const noexcept { return hidden_; }
  /// Labels of the points where they were shared out with an eye to their neighbours; else empty, and the nearest model owns each.
  const kernels::Reused<std::uint16_t>& labels() const noexcept { return labels_; }

 private:
  using Seeds = kernels::Reused<std::vector<models::Position>>;  // of each kind

  /// Gives the evaluator what it is to know.
  Expected<> prepare();
  /// Of several kinds with the plane among them, be it a hidden one: planes that hold much of the cloud and lie flat. Nothing else explains
  /// their points, so that there is no need to look at other kinds, nor at normals, before them.
  Expected<> take_planes_that_stand_out(const Seeds& seeds, const ModelCallback& on_model, FitResult& result);
  /// One round after another until none finds anything.
  Expected<> look_round_by_round(const Seeds& seeds, const ModelCallback& on_model, FitResult& result);
  /// A swarm of each kind, and the best of what they came to.
  Expected<Outcome> search(const Seeds& seeds, Candidate& best);
  /// The same before the best of several kinds has stood its contest.
  Expected<Outcome> search_each(const Seeds& seeds, Candidate& best);
  Seeds seeds_from(const std::vector<Model>& warm_start) const;
  /// Takes a model without a search, if it pays.
  Expected<> adopt(const Known& known, const ModelCallback& on_model, FitResult& result);
  /// What follows once a search has come to a model, be it a hidden one.
  Expected<> take(const Candidate& candidate, Outcome outcome, const ModelCallback& on_model, FitResult& result);
  Expected<> take_found(Candidate& candidate, const ModelCallback& on_model, FitResult& result);
  bool accept(const Candidate& candidate, const ModelCallback& on_model, FitResult& result);
  Expected<> share_out(const ModelCallback& on_model, FitResult& result, std::span<const models::Placed> others);
  bool ends_jointly() const;
  void tell_parameters(FitResult& result) const;
  void count_effort(FitResult& result) const;
  bool full() const noexcept { return pilot_.limits().max_models > 0 && found_.size() >= pilot_.limits().max_models; }
  /// Do fewer points remain unexplained than a model must have?
  bool too_few_left() const;
  /// Has a swarm in vain come to what the one before it came to?
  bool agree(double saving, double before) const noexcept;

  const Problem problem_;
  Unexplained left_;
  Pilot pilot_;
  Candidates candidates_;
  Search search_;
  Contest contest_;
  Polish polish_;
  std::function<void(std::span<const float>)> learn_;
  std::unique_ptr<ShareOut> share_out_;  // where the joint end of correspondences has begun
  kernels::Reused<models::Placed> found_, hidden_;
  kernels::Reused<std::uint16_t> labels_;
  bool points_set_ = false;
  bool stopped_by_caller_ = false;
  kernels::Effort effort_before_, effort_beside_;  // of the evaluator in earlier searches, and of another one
};

}  // namespace swarmfit::swarm
