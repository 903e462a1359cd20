// What swarms come to, and how it is looked at on all points.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <swarmfit/error.hpp>

#include "host/swarm/deflation.hpp"
#include "host/swarm/payment.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

/// What a swarm came to.
struct Candidate {
  std::size_t kind = 0;
  models::Position theta;
  double loss = 0;
  double saving = 0;                      ///< of the swarm's best, on the points that were searched
  kernels::Reused<float> distances = {};  ///< of all points, where these are listed
  Support support = {};
};

/// What is to become of it, the least first.
enum class Outcome { interrupted, unpaid, complete, rejected, flat, found };

/// Refines candidates under what is left to explain, counts what speaks for them, and takes what they explain away.
class Candidates {
 public:
  Candidates(const Problem& problem, Unexplained& left) : problem_(problem), left_(left) {}

  /// First on the part, where that is what was searched. Fills all but the saving.
  Expected<> refine(Candidate& candidate) const;
  /// So many rounds of refinement on all points; distances, loss and support of what comes of it.
  Expected<> look(Candidate& candidate, int rounds) const;
  /// Its support anew, by the caps as they are now; it stays where it is.
  Expected<> recount(Candidate& candidate) const { return count(candidate, left_.caps(), left_.near()); }
  /// Does it pay for itself?
  bool pays(const Candidate& candidate) const;
  /// By what surrounds it alone?
  bool pays_among_others(const Candidate& candidate) const;
  /// What the candidate explains sinks out of the caps.
  Expected<> deflate(const Candidate& candidate) const;
  /// Where a plane that was found runs across two surfaces, one of these takes its place; the other is what is returned.
  Expected<std::optional<models::Position>> come_apart(Candidate& candidate);

 private:
  /// The candidate's support, by its distances.
  Expected<> count(Candidate& candidate, std::span<const float> caps, const Near& near) const;
  /// Of the points, the share that chance puts within tau of the candidate at least. An empty gap on either side is chance as well, and many
  /// lines are looked at.
  double strewn(const Candidate& candidate) const;
  DeadZone dead_zone(const Candidate& candidate, std::span<const float> caps) const;
  Expected<> sink(const Candidate& candidate, std::vector<float>& caps, Near& near) const;
  /// visit(first, distances) for runs of points, from the first to the last.
  template <class Visit>
  Expected<> in_runs(const Candidate& candidate, Visit&& visit) const;

  const Problem& problem_;
  Unexplained& left_;
  std::uint32_t splits_ = 0;  // looked for so far
};

}  // namespace swarmfit::swarm
