// Between kinds: who wins a round, and what a curved winner must show for itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/swarm/candidates.hpp"
#include "host/swarm/pilot.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/search.hpp"
#include "host/swarm/unexplained.hpp"
#include "host/swarm/worth.hpp"

namespace swarmfit::swarm {

class Contest {
 public:
  Contest(const Problem& problem, Unexplained& left, Pilot& pilot, const Candidates& candidates, Search& search)
      : problem_(problem), left_(left), pilot_(pilot), candidates_(candidates), search_(search), worth_(problem, left) {}

  /// The winner must stand against the other kinds on its own points; another may take its place.
  Expected<Outcome> hold(Candidate& winner);
  /// Where nothing curved pays: is a hidden flat model in the way?
  Expected<Outcome> look_flat(Candidate& best, Outcome otherwise);
  /// A model was found: flat ones may be in the way again.
  void found() noexcept { looked_flat_ = false; }
  /// The points of a candidate that was rejected are worth less from now on; it is no neighbour of theirs.
  Expected<> set_aside(const Candidate& candidate);

 private:
  /// By each curved kind from `first` up to `last`; the better one is the winner then.
  Expected<> challenge_by(std::size_t first, std::size_t last, Candidate& winner);
  Expected<bool> challenge(const Candidate& winner, Candidate& challenger);
  /// The best model of a kind under these caps, and its distances; false if there is none.
  Expected<bool> best_on(std::size_t kind, std::span<const float> caps, models::Position& theta, std::vector<float>& distances);
  /// Is a curved model more than flat ones through the same points? `flat` is the best of these, where one was looked for.
  Expected<bool> bends(const Candidate& winner, models::Position& flat);
  /// The flat model takes the winner's place.
  Expected<Outcome> flatten(Candidate& winner, models::Position flat);

  const Problem& problem_;
  Unexplained& left_;
  Pilot& pilot_;
  const Candidates& candidates_;
  Search& search_;
  Worth worth_;
  std::uint32_t contests_ = 0;  // swarms flown for them
  bool looked_flat_ = false;    // since the last model was found
};

}  // namespace swarmfit::swarm
