// Figures 4 and 5 of the paper, and the contours of segmentation with fixation, on one frame.
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <swarmfit/figures.hpp>

#include "host/common/thrown.hpp"
#include "host/io/jpeg.hpp"
#include "host/io/palette.hpp"
#include "host/perception/boundary.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit {
namespace {

using perception::PixelGrid;
using perception::SegmentationInput;
using perception::SoiRegion;

constexpr int kPanelWidth = 480;  // [px]
constexpr int kCaption = 20;      // [px] height of the line below a panel

/// What all panels are drawn from. Pictures are RGB.
struct Stages {
  const PerceiveResult& result;
  SegmentationInput input;
  PixelGrid grid;
  std::vector<SoiRegion> regions;
  cv::Mat3b photo;
};

cv::Vec3b rgb(const io::Rgb& colour) { return {colour[0], colour[1], colour[2]}; }
cv::Vec3b mixed(const cv::Vec3b& a, const cv::Vec3b& b, double share) {
  cv::Vec3b out;
  for (int c = 0; c < 3; ++c) out[c] = cv::saturate_cast<std::uint8_t>(a[c] * (1 - share) + b[c] * share);
  return out;
}
cv::Mat3b dimmed(const cv::Mat3b& photo) { return photo * 0.35; }

/// Colours each pixel by its label, 0 left as it is.
cv::Mat3b tinted(const cv::Mat3b& ground, const std::vector<std::uint16_t>& labels, double share) {
  cv::Mat3b out = ground.clone();
  for (int v = 0; v < out.rows; ++v)
    for (int u = 0; u < out.cols; ++u) {
      const std::size_t k = labels[static_cast<std::size_t>(v * out.cols + u)];
      if (k == kUncertain)
        out(v, u) = mixed(out(v, u), rgb(io::kUnlabelled), 0.9);
      else if (k > 0)
        out(v, u) = mixed(out(v, u), rgb(io::plane_colour(k)), share);
    }
  return out;
}

cv::Mat3b planes(const Stages& s) {
  cv::Mat3b out = s.photo.clone();
  for (int v = 0; v < out.rows; ++v)
    for (int u = 0; u < out.cols; ++u) {
      const std::size_t i = s.grid.index(u, v), plane = s.result.fit.labels[i];
      if (s.result.popout[i] != 0)
        out(v, u) = mixed(out(v, u), rgb(io::kStickingOut), 0.65);
      else if (plane != 0)
        out(v, u) = mixed(out(v, u), rgb(io::plane_colour(plane)), s.result.fit.models[plane - 1].supporting ? 0.6 : 0.25);
    }
  return out;
}

cv::Mat3b spaces(const Stages& s) {
  cv::Mat3b out = s.photo.clone();
  for (const SoiRegion& region : s.regions)
    if (region.label != 0) cv::rectangle(out, region.rect, cv::Scalar(255, 221, 0), std::max(1, out.cols / 400));
  return out;
}

/// Dark is cheap; of several regions at one pixel the cheapest shows.
template <class CostOf>
cv::Mat3b cost_map(const Stages& s, double most, const CostOf& cost_of) {
  cv::Mat1d cost(s.photo.size(), std::numeric_limits<double>::infinity());
  for (const SoiRegion& region : s.regions) {
    if (region.label == 0) continue;
    const cv::Mat1d of_region = cost_of(region);
    for (int y = 0; y < region.rect.height; ++y)
      for (int x = 0; x < region.rect.width; ++x) {
        double& least = cost(region.rect.tl() + cv::Point(x, y));
        least = std::min(least, of_region(y, x));
      }
  }
  cv::Mat3b out = dimmed(s.photo);
  for (int v = 0; v < out.rows; ++v)
    for (int u = 0; u < out.cols; ++u)
      if (cost(v, u) <= most * 2) out(v, u) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(255 * cost(v, u) / most));
  return out;
}

cv::Mat3b borders(const Stages& s) {
  cv::Mat1b grey;
  perception::boundary_probability(s.input.frame).convertTo(grey, CV_8U, 255);
  cv::Mat3b out;
  cv::cvtColor(grey, out, cv::COLOR_GRAY2RGB);
  for (const SoiRegion& region : s.regions)
    if (region.label != 0)
      for (const auto& fixation : perception::find_fixations(s.input, s.grid, region))
        cv::drawMarker(out, fixation.at, cv::Scalar(255, 221, 0), cv::MARKER_CROSS, out.cols / 45, std::max(1, out.cols / 320));
  return out;
}

cv::Mat3b captioned(const cv::Mat3b& picture, const std::string& caption) {
  cv::Mat3b panel;
  cv::resize(picture, panel, {kPanelWidth, std::max(1, picture.rows * kPanelWidth / picture.cols)}, 0, 0,
             picture.cols > kPanelWidth ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::copyMakeBorder(panel, panel, 0, kCaption, 0, 0, cv::BORDER_CONSTANT, cv::Scalar::all(255));
  cv::putText(panel, caption, {4, panel.rows - 6}, cv::FONT_HERSHEY_SIMPLEX, 0.42, cv::Scalar::all(0), 1, cv::LINE_AA);
  return panel;
}

/// Panels two a row.
Figure figure(std::string name, std::string shows, const std::vector<std::pair<cv::Mat3b, std::string>>& pictures) {
  std::vector<cv::Mat> rows;
  for (std::size_t k = 0; k + 1 < pictures.size(); k += 2) {
    cv::Mat row;
    cv::hconcat(captioned(pictures[k].first, pictures[k].second), captioned(pictures[k + 1].first, pictures[k + 1].second), row);
    rows.push_back(row);
  }
  cv::Mat sheet;
  cv::vconcat(rows, sheet);
  constexpr int kQuality = 80;
  return {std::move(name), std::move(shows), io::encode_jpeg(sheet, kQuality)};
}

std::vector<std::uint16_t> outlines(const SegmentationInput& input, PerceiveOptions options, Preset preset, Segmentation segmentation) {
  options.fit.preset = preset;
  options.segmentation = segmentation;
  return segment_objects(input, options);
}

std::vector<Figure> draw(const Stages& s, const PerceiveOptions& options) {
  const auto costs = [&](const SoiRegion& region) { return perception::paper_costs(s.input, s.grid, region, options); };
  const cv::Mat3b dim = dimmed(s.photo);
  std::vector<Figure> all;
  all.push_back(figure("fig4-planes.jpg", "supporting planes, what sticks out of them yellow",
                       {{s.photo, "the frame"}, {planes(s), "planes in colours, others faint; sticking-out points yellow"}}));
  all.push_back(figure(
      "fig5-segmentation.jpg", "spaces of interest, their points, costs of the object and of the background, the cut",
      {{spaces(s), "(a) spaces of interest"},
       {tinted(dim, s.result.popout, 0.9), "(b) their points, back-projected"},
       {cost_map(s, 1.2, [&](const SoiRegion& r) { return costs(r).object; }), "(c) cost of the object, dark is cheap"},
       {cost_map(s, 0.6, [&](const SoiRegion& r) { return costs(r).background; }), "(d) cost of the background, dark is cheap"},
       {tinted(dim, outlines(s.input, options, Preset::paper, Segmentation::graphcut), 0.75), "(e) the paper's cut; uncertain in grey"},
       {tinted(dim, outlines(s.input, options, Preset::fast, Segmentation::graphcut), 0.75), "(f) the default cut; uncertain in grey"}}));
  all.push_back(figure("fixation.jpg", "segmentation with fixation: borders in the picture, and the contours",
                       {{borders(s), "borders by colour and texture, and the fixations"},
                        {tinted(dim, outlines(s.input, options, Preset::fast, Segmentation::fixation), 0.75), "contours"}}));
  return all;
}

}  // namespace

Expected<std::vector<Figure>> perception_figures(const Cloud& frame, const PerceiveOptions& options) try {
  if (!frame.organised() || !frame.coloured())
    return fail(Error::Kind::bad_input, "the frame has no image grid or no colour, must have both for figures of outlines");
  auto perceiver = Perceiver::create(options);
  if (!perceiver) return tl::unexpected(perceiver.error());
  const auto result = perceiver->perceive(frame);
  if (!result) return tl::unexpected(result.error());
  Stages stages{*result, {frame, result->fit.labels, result->popout, result->sois}, PixelGrid(frame), {}, {}};
  stages.regions = perception::soi_regions(stages.input, stages.grid, options.soi_margin, 2, options.fit.threads);
  stages.photo = cv::Mat3b(frame.height, frame.width, reinterpret_cast<cv::Vec3b*>(const_cast<std::uint8_t*>(frame.rgb.data())));
  return draw(stages, options);
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [] { return std::string("no memory for the figures"); });
}

}  // namespace swarmfit
