// The joint end of correspondences: points are shared out among the models, and more models are looked for with an eye to all of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/swarm/candidates.hpp"
#include "host/swarm/labelling.hpp"
#include "host/swarm/pilot.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

class ShareOut {
 public:
  ShareOut(const Problem& problem, Unexplained& left, Pilot& pilot, const Candidates& candidates);

  /// Among `found` and, where they lower the joint energy, `proposals` and what further swarms come to.
  Expected<> run(std::span<const models::Placed> found, std::span<const models::Position> proposals);
  /// What another search has come to, `others`, contends for the points. `models` are what is known of `found`, one each: both become what
  /// stays, or nothing where none of it pays. True for models that are new among them.
  Expected<std::vector<bool>> conclude(std::span<const models::Placed> others, std::vector<models::Placed>& found,
                                       std::vector<Model>& models);
  /// Of all points, once it has concluded.
  kernels::Reused<std::uint16_t> labels() const;

 private:
  /// Sets of points, by what tells them apart.
  using Seen = std::set<std::pair<std::uint64_t, std::uint64_t>>;

  Expected<> search_further();
  /// Does one of the models pay for itself, beside no other? `any_found`: one of the first search did.
  Expected<bool> any_pays(bool any_found);
  /// Does this one, which has been looked at, where the points of a model are set aside? `together`: points lie together as those of bodies do.
  Expected<bool> pays_beside(Candidate& candidate, std::optional<std::size_t> aside, bool together);
  /// Models are replaced, split and joined by samples of their own points while that lowers the joint energy.
  Expected<> regroup();
  /// One round of it; true if anything has changed.
  Expected<bool> regroup_each(Seen& seen);
  Expected<bool> regroup_pairs(Seen& seen);
  Expected<bool> regroup_one(std::size_t model);
  Expected<bool> regroup_two(std::size_t one, std::size_t other);
  /// `samples` and models through so many samples of the points of which marks are not 0; none where these are too few.
  kernels::Reused<models::Position> samples_of(std::span<const float> marks, int count, kernels::Reused<models::Position> samples);
  /// What is told of a new model.
  Expected<> describe(std::size_t of, std::span<const std::uint16_t> labels, Model& model) const;

  const Problem& problem_;
  Unexplained& left_;
  Pilot& pilot_;
  const Candidates& candidates_;
  Labelling labelling_;
};

}  // namespace swarmfit::swarm
