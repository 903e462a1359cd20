#include "host/perception/segmentation.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "host/common/parallel.hpp"
#include "host/perception/runs.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

void measure_distances(const SegmentationInput& input, const PixelGrid& grid, SoiRegion& region) {
  cv::Mat1b off(region.rect.size());
  for (int y = 0; y < off.rows; ++y)
    for (int x = 0; x < off.cols; ++x) off(y, x) = input.popout[grid.index(region.rect.x + x, region.rect.y + y)] == region.label ? 0 : 255;
  cv::distanceTransform(off, region.distance, cv::DIST_L2, cv::DIST_MASK_5);
}

/// At most `largest` of the pixels' colours, evenly spread over them.
void add_colours(const PixelGrid& grid, const std::vector<std::size_t>& pixels, std::size_t largest, ColourSample& sample) {
  const std::size_t count = std::min(pixels.size(), largest);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* rgb = grid.rgb(pixels[k * pixels.size() / count]);
    sample.add(rgb[0], rgb[1], rgb[2]);
  }
  sample.close(largest);
}

}  // namespace

std::vector<SoiRegion> soi_regions(const SegmentationInput& input, const PixelGrid& grid, double margin, int least_border, int threads) {
  struct Box {
    int left = 1 << 30, top = 1 << 30, right = -1, bottom = -1;
  };
  std::vector<Box> boxes(input.sois.size());
  for (int v = 0; v < grid.height(); ++v) {
    const std::size_t row = grid.index(0, v);
    for_each_run(input.popout, row, grid.index(0, v + 1), [&](std::size_t first, std::size_t last, std::uint16_t k) {
      if (k > boxes.size()) return;
      Box& box = boxes[k - 1U];
      box = {std::min(box.left, static_cast<int>(first - row)), std::min(box.top, v), std::max(box.right, static_cast<int>(last - row) - 1),
             std::max(box.bottom, v)};
    });
  }
  std::vector<SoiRegion> regions(input.sois.size());
  const cv::Rect image(0, 0, grid.width(), grid.height());
  common::in_parallel(static_cast<int>(boxes.size()), 1, threads, [&](int first, int last) {
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k) {
      const Box& box = boxes[k];
      if (box.right < 0) continue;
      SoiRegion& region = regions[k];
      region.label = static_cast<std::uint16_t>(k + 1);
      const int width = box.right - box.left + 1, height = box.bottom - box.top + 1;
      const int border = std::max(least_border, static_cast<int>((margin - 1) * std::max(width, height) / 2 + 0.5));
      const auto& soi_box = input.sois[k].bbox;
      region.rect = cv::Rect(box.left - border, box.top - border, width + 2 * border, height + 2 * border);
      if (soi_box[2] > 0 && soi_box[3] > 0) region.rect |= cv::Rect(soi_box[0], soi_box[1], soi_box[2], soi_box[3]);
      region.rect &= image;
      measure_distances(input, grid, region);
    }
  });
  return regions;
}

SoiColours soi_colours(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, int neighbours, int bits,
                       std::size_t largest) {
  SoiColours colours{ColourSample(neighbours, bits), ColourSample(neighbours, bits)};
  const SpaceOfInterest& soi = input.sois[region.label - 1U];
  const double reach = soi.radius * soi.radius;
  std::vector<std::size_t> object, background;
  for (int v = region.rect.y; v < region.rect.br().y; ++v)
    for (int u = region.rect.x; u < region.rect.br().x; ++u) {
      const std::size_t i = grid.index(u, v);
      if (input.popout[i] == region.label)
        object.push_back(i);
      else if ((grid.point(i) - soi.centre).squaredNorm() <= reach)  // not where the sensor saw nothing
        background.push_back(i);
    }
  add_colours(grid, object, largest, colours.object);
  add_colours(grid, background, largest, colours.background);
  return colours;
}

std::vector<std::uint16_t> segment_objects(const SegmentationInput& input, const PerceiveOptions& options) {
  if (input.sois.empty()) return std::vector<std::uint16_t>(input.popout.size(), 0);
  if (options.segmentation == Segmentation::fixation) return segment_fixation(input, options);
  return options.fit.preset == Preset::paper ? segment_paper(input, options) : segment_fused(input, options);
}

}  // namespace swarmfit::perception
