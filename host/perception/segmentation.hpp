// Outlines of the objects in the image: by graph cuts over three labels (object, background, uncertain), or by contours around fixations.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <swarmfit/perception.hpp>

#include "host/perception/colour_cost.hpp"

namespace swarmfit::perception {

/// What the cut starts from: 3D knowledge on the image grid.
struct SegmentationInput {
  const Cloud& frame;                           ///< organised and coloured
  std::span<const std::uint16_t> plane_labels;  ///< one a pixel: k-th plane, 0 none
  std::span<const std::uint16_t> popout;        ///< one a pixel: k-th SOI, 0 none
  std::span<const SpaceOfInterest> sois;
  ColourWork* colours = nullptr;  ///< where colour costs are worked out; null: one after another, here
};

/// objects: one a pixel, 0 background, k the k-th proto-object (that of the k-th SOI), kUncertain.
std::vector<std::uint16_t> segment_objects(const SegmentationInput& input, const PerceiveOptions& options);

}  // namespace swarmfit::perception
