// Objects from patches: by the edges they meet at, by hollows and their shells, and across what stands before them.
#pragma once

#include <vector>

#include "host/perception/contacts.hpp"
#include "host/perception/patches.hpp"

namespace swarmfit::perception {

struct Objects {
  std::vector<int> of_patch;  ///< one a patch: its object, 0-based and without gaps
  int count = 0;
};

Objects group_patches(const PointGrid& grid, const CoarseGrid& coarse, const Patches& patches, const GroupingOptions& options);

}  // namespace swarmfit::perception
