// One search: a swarm of one kind over what is left to explain, and what it comes to.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/swarm/candidates.hpp"
#include "host/swarm/pilot.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"
#include "host/swarm/worth.hpp"

namespace swarmfit::swarm {

class Search {
 public:
  Search(const Problem& problem, const Unexplained& left, Pilot& pilot, const Candidates& candidates)
      : problem_(problem), left_(left), pilot_(pilot), candidates_(candidates), worth_(problem, left) {}

  /// A swarm of the candidate's kind, and what it came to.
  Expected<Outcome> explore(std::uint32_t round, std::span<const models::Position> seeds, Candidate& candidate);
  /// Swarms of kinds that say so end soon, until told otherwise.
  void end_soon(bool soon) noexcept { soon_ = soon; }
  bool ends_soon() const noexcept { return soon_; }
  /// After so many swarms in a row that found nothing all later ones begin with more samples: what is left is hit by fewer of them.
  void look_harder(int times) noexcept { vain_ = std::max(vain_, times); }
  /// Where the joint end chooses from them: what particles of all swarms knew.
  const std::vector<models::Position>& proposals() const noexcept { return proposals_; }

 private:
  Settings settings_of(std::size_t kind) const;
  /// What saves most may run across several surfaces, and not pay where one of these would: of the bests of other stretches of the ring the
  /// candidate becomes the first that does, away from what was found; false if none does.
  Expected<bool> look_beside(const Swarm& swarm, Candidate& candidate) const;

  const Problem& problem_;
  const Unexplained& left_;
  Pilot& pilot_;
  const Candidates& candidates_;
  Worth worth_;
  bool soon_ = false;
  int vain_ = 0;  // most swarms in a row that found nothing
  std::vector<models::Position> proposals_;
};

}  // namespace swarmfit::swarm
