// The frame as the segmentations read it.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "host/perception/segmentation.hpp"

namespace swarmfit::perception {

/// Costs are in [0, 1] a term; whole numbers for the cut.
inline constexpr double kCostUnit = 4096;
inline std::int64_t to_cost(double cost) { return static_cast<std::int64_t>(std::lround(kCostUnit * cost)); }

class PixelGrid {
 public:
  explicit PixelGrid(const Cloud& frame) : frame_(frame) {}

  int width() const noexcept { return frame_.width; }
  int height() const noexcept { return frame_.height; }
  std::size_t size() const noexcept { return frame_.size(); }
  std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(frame_.width) + static_cast<std::size_t>(u);
  }
  Eigen::Vector3d point(std::size_t i) const {
    if (frame_.values64.empty()) return {frame_.values32[3 * i], frame_.values32[3 * i + 1], frame_.values32[3 * i + 2]};
    return {frame_.values64[3 * i], frame_.values64[3 * i + 1], frame_.values64[3 * i + 2]};
  }
  bool finite(std::size_t i) const {
    // The sum of floats does not overflow in double precision; that of doubles means the same for all a sensor can tell.
    return frame_.values64.empty()
               ? std::isfinite(static_cast<double>(frame_.values32[3 * i]) + static_cast<double>(frame_.values32[3 * i + 1]) +
                               static_cast<double>(frame_.values32[3 * i + 2]))
               : std::isfinite(frame_.values64[3 * i] + frame_.values64[3 * i + 1] + frame_.values64[3 * i + 2]);
  }
  const std::uint8_t* rgb(std::size_t i) const { return &frame_.rgb[3 * i]; }

 private:
  const Cloud& frame_;
};

/// Where one space of interest lies in the image.
struct SoiRegion {
  std::uint16_t label = 0;  ///< k, 1-based; 0 where the SOI has no pixel
  cv::Rect rect;            ///< the group's box, enlarged by the SOI's margin
  cv::Mat1f distance;       ///< in rect: to the nearest pixel of the group [px]
};

/// One region a SOI, in their order.
std::vector<SoiRegion> soi_regions(const SegmentationInput& input, const PixelGrid& grid, double margin, int least_border, int threads);

/// Colour samples of a space of interest: `object` from its back-projected points, `background` from the others within its sphere.
struct SoiColours {
  ColourSample object, background;

  void want(const std::uint8_t* rgb) {
    object.want(rgb[0], rgb[1], rgb[2]);
    background.want(rgb[0], rgb[1], rgb[2]);
  }
  void settle(ColourWork* work) {
    object.settle(work);
    background.settle(work);
  }
};
SoiColours soi_colours(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, int neighbours, int bits,
                       std::size_t largest);

/// What it costs the pixels of a region to be object (colour and distance, in [0, 2]) and to be background (colour, in [0, 1]).
struct PaperCosts {
  cv::Mat1d object, background;
};
PaperCosts paper_costs(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, const PerceiveOptions& options);

/// The paper's cut, one SOI after another. segmentation_paper.cpp
std::vector<std::uint16_t> segment_paper(const SegmentationInput& input, const PerceiveOptions& options);
/// Weights of the fused cut, chosen on labelled Kinect frames.
struct FusedTuning {
  double band = 6;                 ///< seen pixels farther from every group are background [px at 640 columns]
  double reach = 20;               ///< so are unseen ones farther than this
  double smoothness = 1.2;         ///< of a boundary between two alike pixels side by side
  double flat = 0.1;               ///< share of that which contrast cannot take away
  double at_jump = 0.2;            ///< share that is left where the depth breaks
  double uncertain = 0.6;          ///< cost of the third label, for unseen pixels
  double depth = 1.2;              ///< what the depth says, where there is one
  double colour_with_depth = 0.3;  ///< and how much the colour counts beside it
  double rise_from = 0.5;          ///< heights below this many sigma speak for the plane
  double spatial = 0.15;           ///< of the distance from the group, at reach
  double colour_floor = 0.05;      ///< two colour costs well below this tell nothing
  double alien = 1.5;              ///< of a colour's distance to both samples
  std::size_t largest_sample = 128;
};

/// One cut for all SOIs, with what the depth knows. segmentation_fused.cpp
std::vector<std::uint16_t> segment_fused(const SegmentationInput& input, const PerceiveOptions& options, const FusedTuning& tuning = {});

/// Where a contour is drawn around.
struct Fixation {
  cv::Point at;      ///< [px]
  double clear = 0;  ///< [px] to the border of the piece it lies in
  cv::Rect rect;     ///< what the contour may fill
};
/// One for each piece of a SOI's group in the image: what stands before a thing may part it.
std::vector<Fixation> find_fixations(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region);

/// A closed contour around each fixation. segmentation_fixation.cpp
std::vector<std::uint16_t> segment_fixation(const SegmentationInput& input, const PerceiveOptions& options);

}  // namespace swarmfit::perception
