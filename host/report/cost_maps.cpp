#include "host/report/cost_maps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::report {
namespace {

constexpr int kLeastBorder = 2;  // [px] around a group, as in the figures

std::uint8_t level(double cost) { return static_cast<std::uint8_t>(1 + std::lround(254 * std::clamp(cost, 0.0, 1.0))); }

}  // namespace

CostMaps cost_maps(const PerceiveResult& result, const Cloud& frame) {
  if (!frame.organised() || !frame.coloured() || result.sois.empty()) return {};
  const perception::PixelGrid grid(frame);
  const perception::SegmentationInput input{frame, result.fit.labels, result.popout, result.sois};
  const PerceiveOptions options;
  CostMaps maps{cv::Mat1b::zeros(frame.height, frame.width), cv::Mat1b::zeros(frame.height, frame.width)};
  cv::Mat1d least(frame.height, frame.width, std::numeric_limits<double>::infinity());
  for (const perception::SoiRegion& region : perception::soi_regions(input, grid, options.soi_margin, kLeastBorder, 0)) {
    if (region.label == 0) continue;
    const perception::PaperCosts costs = perception::paper_costs(input, grid, region, options);
    for (int y = 0; y < region.rect.height; ++y) {
      for (int x = 0; x < region.rect.width; ++x) {
        const int v = region.rect.y + y, u = region.rect.x + x;
        if (costs.object(y, x) >= least(v, u)) continue;
        least(v, u) = costs.object(y, x);
        maps.object(v, u) = level(costs.object(y, x));
        maps.background(v, u) = level(costs.background(y, x));
      }
    }
  }
  return maps;
}

}  // namespace swarmfit::report
