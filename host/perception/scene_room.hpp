// What stands in the synthetic room.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host/perception/scene_solids.hpp"

namespace swarmfit::perception {

struct Room {
  std::vector<Solid> solids;
  std::vector<double> support_heights;         ///< z of the k-th supporting surface [m]
  std::vector<std::string> object_names;       ///< of the k-th object
  std::vector<std::uint16_t> object_supports;  ///< which of the supporting surfaces it stands on, 1-based
  std::vector<std::size_t> picture_solids;     ///< solids whose front carries a print of its own
};

/// Floor, wall, a table and a shelf of three boards, each loaded with things drawn from the seed.
Room furnish_room(std::uint64_t seed);

}  // namespace swarmfit::perception
