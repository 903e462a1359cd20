// The joint end of correspondences: points are shared out among the models, and more models are looked for with an eye to all of them.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "host/swarm/labelling.hpp"
#include "host/swarm/multi_model.hpp"
#include "host/swarm/sampler.hpp"
#include "host/swarm/swarm.hpp"

namespace swarmfit::swarm {
namespace {

constexpr int kRegroupings = 4;                  // rounds; what has not changed since it was looked at is not looked at again
constexpr double kTogether = 0.57;               // of coherence: neighbours among strewn outliers agree less, those of bodies more
constexpr int kSamples = 50, kJoinSamples = 20;  // of the points of one model, and of two

}  // namespace

bool MultiModel::shares_out() const noexcept { return settings_.joint && !part_searched_ && settings_.prices.smoothness > 0; }

Expected<> MultiModel::search_further(Labelling& labelling) {
  // Swarms look for what lowers the joint energy: each point may still save what it costs now. Two models that the first search took for
  // one come apart here, and what was too little to be seen beside the large ones is seen.
  constexpr float kAnyPoint = 0;
  const std::string before = stop_reason_;
  while (!interrupted()) {
    labelling.costs(caps_);
    if (auto done = show(caps_); !done) return done;
    Swarm swarm(space(0), settings_, random_);
    auto flown = fly(swarm, 0, round_++, {}, caps_, kAnyPoint);
    if (!flown) return tl::unexpected(flown.error());
    if (!*flown) {
      if (!interrupted()) stop_reason_ = before;
      return {};
    }
    Candidate candidate;
    candidate.theta = swarm.best();
    if (auto done = refine(candidate); !done) return done;
    std::vector<models::Position> proposals(swarm.own_bests().begin(), swarm.own_bests().end());
    proposals.push_back(std::move(candidate.theta));
    auto joined = labelling.offer(proposals);
    if (!joined) return tl::unexpected(joined.error());
    if (!*joined) return {};
  }
  return {};
}

Expected<bool> MultiModel::any_pays(const Labelling& labelling) {
  // A model that was fitted to points chosen with it has few just beyond them, be they strewn. So its ring may tell that it pays only where
  // its points lie together as those of one thing do.
  const bool together = labelling.coherence() >= kTogether;
  if (together && !found_.empty()) return true;
  restore_caps();
  for (const models::Position& theta : labelling.models()) {
    Candidate candidate;
    candidate.theta = theta;
    if (auto done = look(candidate, 0); !done) return tl::unexpected(done.error());
    if ((together ? pays : pays_among_others)(candidate.support, settings_, space(0).minimal_sample())) return true;
  }
  return false;
}

Expected<> MultiModel::share_out() {
  labelling_ = std::make_unique<Labelling>(ground_, part_, neighbours_, settings_.prices);
  labelling_->bound(limits_.max_models);
  std::vector<models::Position> start;
  for (const models::Placed& model : found_) start.push_back(model.theta);
  if (auto done = labelling_->start(start); !done) return done;
  if (auto joined = labelling_->offer(proposals_); !joined) return tl::unexpected(joined.error());
  if (auto done = search_further(*labelling_); !done) return done;
  return regroup(*labelling_);
}

Expected<> MultiModel::tell_joined(std::size_t found, Model& model) const {
  std::vector<float> distances(points_.size());
  const auto evidence = weigh(ground_.of(*found_[found].space), found_[found].theta, {}, distances);
  if (!evidence) return tl::unexpected(evidence.error());
  double square = 0;
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    if (labels_[i] != found + 1) continue;
    ++model.inliers;
    square += static_cast<double>(distances[i]) * static_cast<double>(distances[i]);
  }
  model.cost = evidence->cost;
  model.rms = model.inliers > 0 ? std::sqrt(square / static_cast<double>(model.inliers)) : 0.0;
  model.found_at_ms = elapsed_ms();
  return {};
}

Expected<> MultiModel::share_out(FitResult& result, std::span<const models::Placed> others, const ModelCallback& on_model) {
  Labelling& labelling = *labelling_;
  std::vector<models::Position> rivals;
  for (const models::Placed& model : others) rivals.push_back(model.theta);
  if (auto done = labelling.contend(rivals); !done) return done;
  if (auto done = labelling.drop(); !done) return done;
  // Swarms that found nothing may yet have flown through models that the joint end makes out, and what one of them took for a model it may
  // have made more of than there is.
  auto paid = any_pays(labelling);
  if (!paid) return tl::unexpected(paid.error());
  if (!*paid) {
    found_.clear();
    result.models.clear();
    count_effort(result);
    return {};
  }
  found_.clear();
  for (const models::Position& theta : labelling.models()) found_.push_back({&space(0), theta});
  std::vector<Model> kept;
  for (const std::size_t m : labelling.kept()) {
    kept.emplace_back();
    if (m != Labelling::kJoined) kept.back() = std::move(result.models[m]);
    kept.back().type = space(0).type();
  }
  result.models = std::move(kept);
  tell_parameters(result);
  labels_.resize(points_.size());
  labelling.write(labels_);
  count_effort(result);
  for (std::size_t m = 0; m < found_.size(); ++m) {
    if (labelling.kept()[m] != Labelling::kJoined) continue;
    if (auto done = tell_joined(m, result.models[m]); !done) return done;
    if (on_model && !stopped_by_caller_) stopped_by_caller_ = on_model(result.models[m]) == Verdict::stop;
  }
  return {};
}

std::vector<models::Position> MultiModel::samples_of(std::span<const float> marks, int count, std::vector<models::Position> samples) {
  Sampler sampler(points_, part_.index(), neighbours_, space(0), random_);
  if (!sampler.keep_to(marks)) return {};
  const std::vector<models::Position> drawn = sampler.draw_some(static_cast<std::uint32_t>(count), 2, round_++);
  samples.insert(samples.end(), drawn.begin(), drawn.end());
  return samples;
}

Expected<bool> MultiModel::regroup_one(Labelling& labelling, std::size_t model) {
  std::vector<float> marks(points_.size(), 0.0F);
  labelling.mark_owned(model, marks);
  const std::vector<models::Position> samples = samples_of(marks, kSamples, {});
  if (samples.empty()) return false;
  auto replaced = labelling.replace(model, samples);
  if (!replaced) return replaced;
  auto divided = labelling.split(model, samples);
  if (!divided) return divided;
  return *replaced || *divided;
}

Expected<bool> MultiModel::regroup_two(Labelling& labelling, std::size_t one, std::size_t other) {
  std::vector<float> marks(points_.size(), 0.0F);
  labelling.mark_owned(one, marks);
  labelling.mark_owned(other, marks);
  const std::vector<models::Position> samples = samples_of(marks, kJoinSamples, {labelling.models()[one], labelling.models()[other]});
  return samples.empty() ? Expected<bool>(false) : labelling.join(one, other, samples);
}

Expected<> MultiModel::regroup(Labelling& labelling) {
  std::set<std::pair<std::uint64_t, std::uint64_t>> seen;  // sets of points that were looked at
  for (int round = 0; round < kRegroupings; ++round) {
    bool any = false;
    for (std::size_t m = 0; m < labelling.models().size(); ++m) {
      if (interrupted()) return {};
      if (!seen.insert({labelling.owned_set(m), 0}).second) continue;
      auto better = regroup_one(labelling, m);
      if (!better) return tl::unexpected(better.error());
      any = any || *better;
    }
    for (std::size_t one = 0; one < labelling.models().size(); ++one) {
      for (std::size_t other = one + 1; other < labelling.models().size();) {
        if (interrupted()) return {};
        const bool new_pair =
            labelling.border(one, other) > 0 && seen.insert({labelling.owned_set(one), labelling.owned_set(other)}).second;
        auto joined = new_pair ? regroup_two(labelling, one, other) : Expected<bool>(false);
        if (!joined) return tl::unexpected(joined.error());
        any = any || *joined;
        other += *joined ? 0 : 1;
      }
    }
    if (!any) break;
  }
  return {};
}

}  // namespace swarmfit::swarm
