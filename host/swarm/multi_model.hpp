// Algorithm 2 of Zhou et al. 2010 and what makes it better: one model after another until none pays for itself.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/deflation.hpp"
#include "host/swarm/kinds.hpp"
#include "host/swarm/landscape.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/random.hpp"
#include "host/swarm/refinement.hpp"
#include "host/swarm/settings.hpp"
#include "host/swarm/subset.hpp"

namespace swarmfit::swarm {

/// With more points, what is gained by looking closer is nothing beside what they say together.
inline constexpr std::size_t kFewPoints = 2048;

class Labelling;
class Sampler;
class Swarm;

using Clock = std::chrono::steady_clock;

/// When to end early.
struct Limits {
  Clock::time_point start = Clock::now();
  double budget_ms = 0;
  std::stop_token stop;
  std::size_t max_models = 0;
};

/// Who looks on, over all searches of one fit.
struct Watch {
  SwarmObserver observer;  ///< never empty
  std::size_t swarms = 0;  ///< flown so far, of whatever purpose
};

/// One fit's search. The loop is in multi_model.cpp; one search in search.cpp, how its outcome is judged in candidates.cpp, how kinds
/// compete in contest.cpp; the joint end in polish.cpp and, where models share their points out, in share_out.cpp.
class MultiModel {
 public:
  /// `points`: the whole cloud, or a thinned one of the size that the settings of `kinds` were resolved for. `part` is what samples are
  /// drawn from, and where the settings say so what swarms search. `evaluator` is given what is searched. `kinds` must outlive this.
  /// `spread`: how many times the threshold each point may be off (noise_model.hpp); empty: once.
  MultiModel(kernels::FitnessEvaluator& evaluator, std::span<const Kind> kinds, const models::WorkingPoints& points, const Part& part,
             std::uint64_t seed, Limits limits, std::span<const float> spread = {});
  ~MultiModel();
  MultiModel(const MultiModel&) = delete;
  MultiModel& operator=(const MultiModel&) = delete;

  /// Told of each step of each swarm; must outlive this. Null: nobody is.
  void watched_by(Watch* watch) noexcept { watch_ = watch; }
  /// The evaluator has the points of this search already, from one before: setting them again would but sort them anew.
  void points_are_set() noexcept { points_set_ = true; }

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
  void draw_otherwise() noexcept { round_ = kOtherwise; }
  /// The result's models in the frame of the points.
  const std::vector<models::Placed>& found() const noexcept { return found_; }
  /// Flat models that curved ones were taken for; not in the result.
  const std::vector<models::Placed>& hidden() const noexcept { return hidden_; }
  /// Is what is nearer to one of these nobody's in the result? In the plane all outliers are near some line.
  bool hidden_owns() const noexcept { return points_.dimension() == 3; }
  /// Has a model no say in what is nearer to another, be it hidden?
  bool shares_points() const noexcept { return asked_ > 1 || !hidden_.empty(); }
  /// Corner of the loss that models of this kind were refined with last, of tau: 0 for the least absolute deviations, 1 for least squares.
  float corner(const models::ModelSpace& of) const noexcept;
  /// Labels of the points where they were shared out with an eye to their neighbours; else empty, and the nearest model owns each.
  const std::vector<std::uint16_t>& labels() const noexcept { return labels_; }

 private:
  enum class Outcome { interrupted, unpaid, complete, rejected, flat, found };

  /// What a swarm came to.
  struct Candidate {
    std::size_t kind = 0;
    models::Position theta;
    double loss = 0;
    double saving = 0;             // of the swarm's best, on the points that were searched
    std::vector<float> distances;  // of all points, where these are listed
    Support support;
  };
  using Seeds = std::vector<std::vector<models::Position>>;  // of each kind

  /// One swarm of one kind, and what it came to.
  Expected<Outcome> explore(std::uint32_t round, std::span<const models::Position> seeds, Candidate& candidate);
  /// A swarm of each kind, and the best of what they came to.
  Expected<Outcome> search(const Seeds& seeds, Candidate& best);
  /// Flies one swarm over the evaluator's caps, which are those of `caps`; false if it ended early. Samples are of points whose cap is at
  /// least `alive`.
  Expected<bool> fly(Swarm& swarm, std::size_t kind, std::uint32_t round, std::span<const models::Position> seeds,
                     std::span<const float> caps, float alive);
  Expected<> watched_step(Swarm& swarm, std::size_t kind, const Sampler& sampler);
  Seeds seeds_from(const std::vector<Model>& warm_start) const;
  /// Takes a model without a search, if it pays.
  Expected<> adopt(const Known& known, const ModelCallback& on_model, FitResult& result);
  /// What follows once a search has come to a model, be it a hidden one.
  Expected<> take(const Candidate& candidate, Outcome outcome, const ModelCallback& on_model, FitResult& result);
  Expected<> refine(Candidate& candidate);
  /// So many rounds of refinement on all points; distances, loss and support of what comes of it.
  Expected<> look(Candidate& candidate, int rounds);
  /// The candidate's support, by its distances.
  Expected<> count(Candidate& candidate, std::span<const float> caps, const Near& near) const;
  DeadZone dead_zone(const Candidate& candidate, std::span<const float> caps) const;
  /// What the candidate explains sinks out of the caps.
  Expected<> sink(const Candidate& candidate, std::vector<float>& caps, Near& near) const;
  /// Where a plane that was found runs across two surfaces, one of these takes its place; the other is what is returned.
  Expected<std::optional<models::Position>> come_apart(Candidate& candidate);
  Expected<> take_found(Candidate& candidate, const ModelCallback& on_model, FitResult& result);
  Expected<bool> accept(const Candidate& candidate, const ModelCallback& on_model, FitResult& result);
  Expected<> deflate(const Candidate& candidate);
  /// The points of a candidate that was rejected are worth less from now on; it is no neighbour of theirs.
  Expected<> set_aside(const Candidate& candidate);
  static constexpr std::uint32_t kOtherwise = 1U << 20;  // more swarms than any search flies
  /// Each model refined on what the others leave it, as far as that does not raise the energy of all.
  Expected<> polish();
  Expected<> polish_each();
  Expected<> polish_at_once();  ///< a round of it for models that see all points, and only those
  Expected<> keep_what_lowers(const std::vector<models::Placed>& before);
  /// The least absolute deviations of a model run through as many points as it has degrees of freedom (Barrodale and Roberts 1973):
  /// from the points nearest to it, one at a time is exchanged for whichever lowers the loss most, until none does.
  Expected<> run_through_points(models::Placed& model);
  struct Exchange {
    models::Position theta;
    std::vector<std::uint32_t> sample;
    double loss = 0;
  };
  Expected<bool> exchange_one(std::size_t kind, std::span<const std::uint32_t> candidates, std::size_t which, Exchange& best);
  bool ends_jointly() const;
  void tell_parameters(FitResult& result) const;
  /// Shares the points out among what swarms have found, and looks for more with an eye to all of them.
  Expected<> share_out();
  Expected<> share_out(FitResult& result, std::span<const models::Placed> others, const ModelCallback& on_model);
  /// What is known of a model that the joint end made, as accept() has it of one that a swarm found.
  Expected<> tell_joined(std::size_t found, Model& model) const;
  Expected<> share_out_locally();
  Expected<> search_further(Labelling& labelling);
  /// Does one of the joint end's models pay for itself, beside no other?
  Expected<bool> any_pays(const Labelling& labelling);
  /// Models are replaced, split and joined by samples of their own points while that lowers the joint energy.
  Expected<> regroup(Labelling& labelling);
  Expected<bool> regroup_one(Labelling& labelling, std::size_t model);
  Expected<bool> regroup_two(Labelling& labelling, std::size_t one, std::size_t other);
  /// `samples` and models through so many samples of the points of which marks are not 0; none where these are too few.
  std::vector<models::Position> samples_of(std::span<const float> marks, int count, std::vector<models::Position> samples);
  Expected<> drop_unpaid(FitResult& result);
  std::optional<std::string> interrupted() const;
  void restore_caps();
  Expected<> show(std::span<const float> caps);
  void count_effort(FitResult& result) const;
  double elapsed_ms() const;
  double loss_of_nothing(std::span<const float> caps) const;
  /// Distances or caps, one a point, in measures that make the threshold of each tau; in `room` where they are not so already.
  std::span<const float> levelled(std::span<const float> values, std::vector<float>& room) const;
  /// The same of values of some points, by thresholds of those.
  std::span<const float> levelled(std::span<const float> values, std::vector<float>& room, std::span<const float> allowed) const;
  /// Are a candidate's distances kept? Of very many points they would be most of the memory; they are told anew, a run at a time.
  bool lists_distances() const noexcept;
  /// visit(first, distances) for runs of points, from the first to the last.
  template <class Visit>
  Expected<> in_runs(const Candidate& candidate, Visit&& visit) const;
  /// May a model of this kind pay with points that a found one explains less well? Few points are labelled with an eye to their
  /// neighbours, and where each point has a threshold of its own the noise's tails are wide. Of several kinds only what is curved may, in
  /// space: a plane goes on where its surface ends, and cuts through what is round.
  bool may_share(std::size_t kind) const noexcept {
    if (!allowed_.empty()) return false;
    return kinds_.size() == 1 ? part_searched_ : points_.dimension() == 3 && is_curved(space(kind).type());
  }
  bool any_shares() const noexcept { return kinds_.size() == 1 ? may_share(0) : allowed_.empty() && points_.dimension() == 3; }
  /// What chance would save along the models of a kind, under these caps.
  Background background(std::size_t kind, std::span<const float> caps) const;
  /// Do fewer points remain unexplained than a model must have?
  bool too_few_left() const;
  /// Has a swarm in vain come to what the one before it came to?
  bool agree(double saving, double before) const noexcept;
  bool full() const noexcept { return limits_.max_models > 0 && found_.size() >= limits_.max_models; }
  bool shares_out() const noexcept;
  /// Are points so few that each is looked at with those about it?
  bool labels_locally() const noexcept;
  /// Do models of this kind end at the least absolute deviations themselves?
  bool sharpens(const models::ModelSpace& of) const noexcept;
  int full_rounds() const noexcept;  ///< of refinement on all points
  const Ground& searched() const noexcept { return part_searched_ ? part_ground_ : ground_; }
  const models::ModelSpace& space(std::size_t kind) const noexcept { return *kinds_[kind].space; }
  Ground whole(std::size_t kind) const noexcept { return ground_.of(space(kind)); }

  // Between kinds; in contest.cpp.
  double worth(const Candidate& candidate) const;
  double worth(double saved, int freedom) const;
  /// Share of a model's points whose surface lies along it; 1 where normals are not known.
  double agreement(std::size_t kind, const models::Position& theta, std::span<const float> caps, std::span<const float> distances) const;
  /// Share of a model's points that lie along it and in the inner half of its slab.
  double gathered(const Candidate& candidate) const;
  /// The points of a surface have each other for neighbours; what is left here and there of several lies among others' points.
  /// Share of the neighbours of its points that are its own, times that of the points that lie along it.
  double held(const Candidate& candidate) const;
  /// Is a curved model made of what lies here and there?
  bool is_strewn(const Candidate& candidate) const;
  /// Are neighbours off a cylinder to the same side, as those of a box about its edges and its faces are?
  bool is_cornered(const Candidate& candidate) const;
  /// Sum over points of what a model saves [data unit].
  double bare_saving(std::span<const float> caps, std::span<const float> distances) const;
  /// The same of the part's points, in thresholds, times agreement().
  double saving_along(std::size_t kind, const models::Position& theta, std::span<const float> distances) const;
  std::size_t flat_kind(std::size_t curved) const noexcept;
  /// Is there a flat kind that was not asked for? It is the last.
  bool hides_flat() const noexcept { return kinds_.back().hidden && !is_curved(kinds_.back().space->type()); }
  /// Of what the particles of a swarm know, what saves most of the points that lie along it: fitness knows no normals.
  Expected<> choose(const Swarm& swarm, Candidate& candidate) const;
  /// The winner must stand against the other kinds on its own points.
  Expected<Outcome> contest(Candidate& winner);
  /// By each curved kind from `first` up to `last`; the better one is the winner then.
  Expected<> challenge_by(std::size_t first, std::size_t last, Candidate& winner);
  Expected<bool> challenge(const Candidate& winner, Candidate& challenger);
  Expected<bool> best_on(std::size_t kind, std::span<const float> caps, models::Position& theta, std::vector<float>& distances);
  Expected<bool> bends(const Candidate& winner, models::Position& flat);
  /// Where nothing curved pays: is a hidden flat model in the way?
  Expected<Outcome> look_flat(Candidate& best, Outcome otherwise);
  Expected<Outcome> flatten(Candidate& winner, models::Position flat);

  kernels::FitnessEvaluator& evaluator_;
  std::span<const Kind> kinds_;
  std::size_t asked_ = 0;  // the first so many of them; the rest are hidden
  const models::WorkingPoints& points_;
  const Settings& settings_;  // of the first kind; for what all kinds share
  Random random_;
  Limits limits_;
  const Subset& part_;
  const models::Neighbours& neighbours_;
  const models::Neighbours none_;
  const bool part_searched_;
  std::vector<Landscape> landscapes_;  // of the points that are searched, one a kind
  float tau_;
  std::vector<float> allowed_, part_allowed_;  // tau of each point, and of the part's; empty: tau for all
  Ground ground_, part_ground_;                // all points, and the part; as the first kind has it
  std::vector<float> caps_, part_caps_;        // one a point; what is left to explain, in both kinds of deflation. The part's as shown last
  Near near_;
  std::vector<models::Placed> found_, hidden_;
  std::vector<models::Position> proposals_;  // what the joint end may add to them
  std::unique_ptr<Labelling> labelling_;     // the joint end of correspondences
  std::vector<std::uint16_t> labels_;
  double scale_ = 0;                                     // loss of a model that explains nothing
  std::size_t steps_ = 0;                                // of this round's swarms
  std::uint32_t round_ = 0, contests_ = 0, splits_ = 0;  // swarms flown so far
  bool eager_ = false;                                   // do swarms end soon, until one of them finds nothing?
  bool looked_flat_ = false;                             // since the last model was found
  Watch* watch_ = nullptr;
  bool points_set_ = false;
  bool stopped_by_caller_ = false;
  kernels::Effort effort_before_, effort_beside_;  // of the evaluator in earlier searches, and of another one
  std::string stop_reason_;
};

}  // namespace swarmfit::swarm
