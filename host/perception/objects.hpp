// From groups to spaces of interest: objects point by point, and the spheres around them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <swarmfit/perception.hpp>

#include "host/perception/grid.hpp"
#include "host/perception/grouping.hpp"
#include "host/perception/patches.hpp"
#include "host/perception/popout.hpp"

namespace swarmfit::perception {

/// Objects by point and what each stands on.
struct ObjectLabels {
  std::vector<std::uint16_t> of_point;  ///< 0, or k for the k-th object
  std::vector<int> support;             ///< one an object: 0-based index into the surfaces
};

/// Things that touch or are stacked taken apart, on the image grid.
ObjectLabels separate(const PointGrid& grid, Popout popout, const GroupingOptions& options);

/// What is seen of a support within a vessel is the vessel's floor: an island of the support that one object encloses joins it.
/// `planes`: one label a point, of which those with `supporting[label]` are supports.
void fill_basins(const PointGrid& grid, std::span<const std::uint16_t> planes, std::span<const std::uint8_t> supporting, int threads,
                 ObjectLabels& objects);

/// The spaces of interest, those that take up most of the view first, and `objects` renumbered so. Objects with fewer than
/// `min_points` are debris and dropped. `models[s]`: 1-based model of surface s.
std::vector<SpaceOfInterest> make_spaces(const PointGrid& grid, std::span<const int> models, std::size_t min_points, double margin,
                                         int threads, ObjectLabels& objects);

}  // namespace swarmfit::perception
