// The joint end: each model refined on what the others leave it, what no longer pays dropped, and the points of a small cloud labelled.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/model.hpp>

#include "host/swarm/pilot.hpp"
#include "host/swarm/problem.hpp"
#include "host/swarm/unexplained.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {

class Polish {
 public:
  Polish(const Problem& problem, Unexplained& left, Pilot& pilot) : problem_(problem), left_(left), pilot_(pilot) {}

  /// Each of `found` refined on what the others and `hidden` leave it, as far as that does not raise the energy of all. What is left to
  /// explain is not told afterwards.
  Expected<> refine(std::vector<models::Placed>& found, std::span<const models::Placed> hidden);
  /// While there is a model that too few points would miss, it goes, out of `models` as well, and the others are refined together.
  Expected<> drop_unpaid(std::vector<models::Placed>& found, std::vector<Model>& models) const;
  /// Labels of all points with an eye to their neighbours (local_labels.hpp).
  Expected<kernels::Reused<std::uint16_t>> label(std::span<const models::Placed> found, std::span<const models::Placed> hidden) const;

 private:
  using Models = std::vector<models::Placed>;

  Expected<> refine_each(Models& found, std::span<const models::Placed> hidden);
  /// A round of it for models that see all points, and only those.
  Expected<> refine_at_once(Models& found) const;
  Expected<> keep_what_lowers(const Models& before, Models& found) const;
  /// The least absolute deviations of a model run through as many points as it has degrees of freedom (Barrodale and Roberts 1973):
  /// from the points nearest to it, one at a time is exchanged for whichever lowers the loss most, until none does.
  Expected<> run_through_points(models::Placed& model);
  struct Exchange {
    models::Position theta;
    kernels::Reused<std::uint32_t> sample;
    double loss = 0;
  };
  Expected<bool> exchange_one(std::size_t kind, std::span<const std::uint32_t> candidates, std::size_t which, Exchange& best);

  const Problem& problem_;
  Unexplained& left_;
  Pilot& pilot_;
};

}  // namespace swarmfit::swarm
