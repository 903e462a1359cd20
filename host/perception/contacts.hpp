// Where patches meet, and whether the edge between them says one thing or two.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "host/perception/patches.hpp"

namespace swarmfit::perception {

struct GroupingOptions {
  double flood_step = 0.02;                       ///< [m]
  double noise = 0.0015;                          ///< standard deviation of a depth at a range of one metre [m]
  Eigen::Vector3f up = Eigen::Vector3f::UnitZ();  ///< against gravity
  int threads = 0;                                ///< 0: as many as there are
};

struct Contact {
  double weight = 0;  ///< > 0: one thing, < 0: two; summed over the border
  double length = 0;  ///< of the border [cells]
};
/// By pairs of 0-based patches, the lower first.
using Contacts = std::map<std::pair<int, int>, Contact>;

/// Convex and flat edges count for one thing, creases and steps against it. Local convexity after Stein et al. 2014, with
/// hollows that are bent all along (the inside of a bowl) told from creases.
Contacts measure_contacts(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const GroupingOptions& options);

/// One a patch: the lowest patch of its cluster. Joins the pair that most belongs together, adds up its contacts with the
/// others, and so on while any pair does (greedy additive edge contraction, Keuper et al. 2015). Two clusters whose contact is short beside
/// the smaller one merely touch.
std::vector<int> contract(const CoarseGrid& coarse, const Patches& patches, Contacts contacts);

}  // namespace swarmfit::perception
