#include "host/swarm/share_out.hpp"

#include <cmath>

#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr int kRegroupings = 4;                  // rounds; what has not changed since it was looked at is not looked at again
constexpr double kTogether = 0.57;               // of coherence: neighbours among strewn outliers agree less, those of bodies more
constexpr int kSamples = 50, kJoinSamples = 20;  // of the points of one model, and of two
constexpr double kEven = 1.05;                   // of von Neumann's ratio: above it a model's residuals are noise, and it is not two

}  // namespace

ShareOut::ShareOut(const Problem& problem, Unexplained& left, Pilot& pilot, const Candidates& candidates)
    : problem_(problem),
      left_(left),
      pilot_(pilot),
      candidates_(candidates),
      labelling_(problem.ground, problem.part, problem.neighbours, problem.settings.prices) {
  labelling_.stop_when([&pilot] { return pilot.interrupted().has_value(); });
}

Expected<> ShareOut::run(std::span<const models::Placed> found, std::span<const models::Position> proposals) {
  labelling_.bound(pilot_.limits().max_models);
  kernels::Reused<models::Position> start;
  for (const models::Placed& model : found) start.push_back(model.theta);
  if (auto done = labelling_.start(start); !done) return done;
  if (auto joined = labelling_.offer(proposals); !joined) return tl::unexpected(joined.error());
  if (auto done = search_further(); !done) return done;
  return regroup();
}

Expected<> ShareOut::search_further() {
  // Swarms look for what lowers the joint energy: each point may still save what it costs now. Two models that the first search took for
  // one come apart here, and what was too little to be seen beside the large ones is seen.
  constexpr float kAnyPoint = 0;
  const Pilot::Aside aside(pilot_);
  while (!pilot_.interrupted()) {
    labelling_.costs(left_.caps());
    if (auto done = left_.show(); !done) return done;
    Swarm swarm(problem_.space(0), problem_.settings, problem_.random);
    auto flown = pilot_.fly(swarm, 0, pilot_.next_round(), {}, left_.caps(), kAnyPoint);
    if (!flown) return tl::unexpected(flown.error());
    if (!*flown) return {};
    Candidate candidate;
    candidate.theta = swarm.best();
    if (auto done = candidates_.refine(candidate); !done) return done;
    kernels::Reused<models::Position> proposals(swarm.own_bests().begin(), swarm.own_bests().end());
    proposals.push_back(std::move(candidate.theta));
    auto joined = labelling_.offer(proposals);
    if (!joined) return tl::unexpected(joined.error());
    if (!*joined) return {};
  }
  return {};
}

kernels::Reused<models::Position> ShareOut::samples_of(std::span<const float> marks, int count, kernels::Reused<models::Position> samples) {
  Sampler sampler(problem_.points, problem_.part.index(), problem_.neighbours, problem_.space(0), problem_.random);
  if (!sampler.keep_to(marks)) return {};
  const kernels::Reused<models::Position> drawn = sampler.draw_some(static_cast<std::uint32_t>(count), 2, pilot_.next_round());
  samples.insert(samples.end(), drawn.begin(), drawn.end());
  return samples;
}

Expected<bool> ShareOut::regroup_one(std::size_t model) {
  kernels::Reused<float> marks(problem_.points.size(), 0.0F);
  labelling_.mark_owned(model, marks);
  const kernels::Reused<models::Position> samples = samples_of(marks, kSamples, {});
  if (samples.empty()) return false;
  const bool even = labelling_.evenness(model) > kEven;
  auto replaced = labelling_.replace(model, samples);
  if (!replaced) return replaced;
  auto divided = even ? Expected<bool>(false) : labelling_.split(model, samples);
  if (!divided) return divided;
  return *replaced || *divided;
}

Expected<bool> ShareOut::regroup_two(std::size_t one, std::size_t other) {
  kernels::Reused<float> marks(problem_.points.size(), 0.0F);
  labelling_.mark_owned(one, marks);
  labelling_.mark_owned(other, marks);
  const kernels::Reused<models::Position> samples = samples_of(marks, kJoinSamples, {labelling_.models()[one], labelling_.models()[other]});
  return samples.empty() ? Expected<bool>(false) : labelling_.join(one, other, samples);
}

Expected<bool> ShareOut::regroup_each(Seen& seen) {
  bool any = false;
  for (std::size_t m = 0; m < labelling_.models().size(); ++m) {
    if (pilot_.interrupted()) return false;
    if (!seen.insert({labelling_.owned_set(m), 0}).second) continue;
    auto better = regroup_one(m);
    if (!better) return better;
    any = any || *better;
  }
  return any;
}

Expected<bool> ShareOut::regroup_pairs(Seen& seen) {
  bool any = false;
  for (std::size_t one = 0; one < labelling_.models().size(); ++one) {
    for (std::size_t other = one + 1; other < labelling_.models().size();) {
      if (pilot_.interrupted()) return false;
      const bool new_pair =
          labelling_.border(one, other) > 0 && seen.insert({labelling_.owned_set(one), labelling_.owned_set(other)}).second;
      auto joined = new_pair ? regroup_two(one, other) : Expected<bool>(false);
      if (!joined) return joined;
      any = any || *joined;
      other += *joined ? 0 : 1;
    }
  }
  return any;
}

Expected<> ShareOut::regroup() {
  Seen seen;
  for (int round = 0; round < kRegroupings; ++round) {
    const auto alone = regroup_each(seen);
    if (!alone) return tl::unexpected(alone.error());
    const auto paired = regroup_pairs(seen);
    if (!paired) return tl::unexpected(paired.error());
    if (!*alone && !*paired) break;
  }
  return {};
}

Expected<bool> ShareOut::any_pays(bool any_found) {
  // A model that was fitted to points chosen with it has few just beyond them, be they strewn. So its ring may tell that it pays only where
  // its points lie together as those of one thing do.
  const bool together = labelling_.coherence() >= kTogether;
  if (together && any_found) return true;
  // Of two surfaces side by side each is what surrounds the other, so any one other model's points may be set aside. Not those of all: many
  // models explain most of what is strewn, and each would then lie alone.
  const std::size_t count = labelling_.models().size();
  for (std::size_t model = 0; model < count; ++model) {
    Candidate candidate;
    candidate.theta = labelling_.models()[model];
    left_.restore();
    if (auto done = candidates_.look(candidate, 0); !done) return tl::unexpected(done.error());
    for (std::size_t aside = 0; aside < count; ++aside) {
      auto paid = pays_beside(candidate, aside == model ? std::nullopt : std::optional(aside), together);
      if (!paid || *paid) return paid;
    }
  }
  return false;
}

Expected<bool> ShareOut::pays_beside(Candidate& candidate, std::optional<std::size_t> aside, bool together) {
  left_.restore();
  if (aside) {
    kernels::Reused<float> theirs(problem_.points.size(), 0.0F);
    labelling_.mark_owned(*aside, theirs);
    for (std::size_t i = 0; i < theirs.size(); ++i) left_.caps()[i] *= 1 - theirs[i];
  }
  if (auto done = candidates_.recount(candidate); !done) return tl::unexpected(done.error());
  // What is set aside surrounds nothing, but chance had it to choose from.
  candidate.support.unexplained = problem_.points.finite_count();
  return together ? candidates_.pays(candidate) : candidates_.pays_among_others(candidate);
}

Expected<> ShareOut::describe(std::size_t of, std::span<const std::uint16_t> labels, Model& model) const {
  kernels::Reused<float> distances(problem_.points.size());
  const auto evidence = weigh(problem_.ground, labelling_.models()[of], {}, distances);
  if (!evidence) return tl::unexpected(evidence.error());
  double square = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] != of + 1) continue;
    ++model.inliers;
    square += static_cast<double>(distances[i]) * static_cast<double>(distances[i]);
  }
  model.cost = evidence->cost;
  model.rms = model.inliers > 0 ? std::sqrt(square / static_cast<double>(model.inliers)) : 0.0;
  model.found_at_ms = pilot_.elapsed_ms();
  return {};
}

Expected<std::vector<bool>> ShareOut::conclude(std::span<const models::Placed> others, std::vector<models::Placed>& found,
                                               std::vector<Model>& models) {
  kernels::Reused<models::Position> rivals;
  for (const models::Placed& model : others) rivals.push_back(model.theta);
  if (auto done = labelling_.contend(rivals); !done) return tl::unexpected(done.error());
  if (auto done = labelling_.drop(); !done) return tl::unexpected(done.error());
  // Swarms that found nothing may yet have flown through models that the joint end makes out, and what one of them took for a model it may
  // have made more of than there is.
  auto paid = any_pays(!found.empty());
  if (!paid) return tl::unexpected(paid.error());
  found.clear();
  std::vector<Model> before = std::exchange(models, {});
  std::vector<bool> made;
  if (!*paid) return made;
  const kernels::Reused<std::uint16_t> all = labels();
  for (std::size_t m = 0; m < labelling_.models().size(); ++m) {
    const std::size_t place = labelling_.kept()[m];
    found.push_back({&problem_.space(0), labelling_.models()[m]});
    made.push_back(place == Labelling::kJoined);
    models.push_back(made.back() ? Model() : std::move(before[place]));
    models.back().type = problem_.space(0).type();
    if (!made.back()) continue;
    if (auto done = describe(m, all, models.back()); !done) return tl::unexpected(done.error());
  }
  return made;
}

kernels::Reused<std::uint16_t> ShareOut::labels() const {
  kernels::Reused<std::uint16_t> all(problem_.points.size());
  labelling_.write(all);
  return all;
}

}  // namespace swarmfit::swarm
