// The segmentation of Zhou et al. 2010, section IV: in each SOI's rectangle a graph cut over object, background and uncertain.
#include <cmath>
#include <limits>

#include "host/perception/graph_cut.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

// What the paper leaves open, chosen on labelled Kinect frames.
constexpr double kUncertainCost = 0.35;  // of the third label
constexpr double kSmoothness = 0.02;     // of a boundary between two pixels side by side
constexpr double kSpatialReach = 0.25;   // of the rectangle's shorter side: there the spatial cost is 1
constexpr std::size_t kLargestSample = 512;
constexpr int kColourBits = 6;

enum : PottsEnergy::Label { background, object, uncertain };

/// Labels of the rectangle's pixels, row after row.
std::vector<PottsEnergy::Label> cut(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region,
                                    const PerceiveOptions& options) {
  SoiColours colours = soi_colours(input, grid, region, options.colour_neighbours, kColourBits, kLargestSample);
  const double uncertain_cost = options.uncertain_cost > 0 ? options.uncertain_cost : kUncertainCost;
  const double smoothness = options.smoothness > 0 ? options.smoothness : kSmoothness;
  const double reach = kSpatialReach * std::min(region.rect.width, region.rect.height);
  const int width = region.rect.width, height = region.rect.height;
  PottsEnergy energy;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::uint8_t* rgb = grid.rgb(grid.index(region.rect.x + x, region.rect.y + y));
      const double spatial = std::min(1.0, region.distance(y, x) / reach);
      const int node = energy.add_node();
      energy.add_label(background, to_cost(colours.background.cost(rgb[0], rgb[1], rgb[2])));
      energy.add_label(object, to_cost(colours.object.cost(rgb[0], rgb[1], rgb[2]) + spatial));
      energy.add_label(uncertain, to_cost(uncertain_cost));
      // Eight neighbours, each pair once.
      const auto weight = to_cost(smoothness), slanted = to_cost(smoothness / std::sqrt(2.0));
      if (x > 0) energy.add_edge(node - 1, node, weight);
      if (y > 0) energy.add_edge(node - width, node, weight);
      if (x > 0 && y > 0) energy.add_edge(node - width - 1, node, slanted);
      if (x + 1 < width && y > 0) energy.add_edge(node - width + 1, node, slanted);
    }
  energy.close();
  std::vector<PottsEnergy::Label> labels = energy.cheapest();
  const PottsEnergy::Label order[] = {object, background, uncertain};
  energy.minimise(order, 5, labels);
  return labels;
}

}  // namespace

std::vector<std::uint16_t> segment_paper(const SegmentationInput& input, const PerceiveOptions& options) {
  const PixelGrid grid(input.frame);
  std::vector<std::uint16_t> objects(grid.size(), 0);
  // A pixel that two SOIs claim goes to the one whose points are nearer.
  std::vector<float> nearest(grid.size(), std::numeric_limits<float>::infinity());
  for (const SoiRegion& region : soi_regions(input, grid, options.soi_margin, 2)) {
    if (region.label == 0) continue;
    const auto labels = cut(input, grid, region, options);
    std::size_t node = 0;
    for (int y = 0; y < region.rect.height; ++y)
      for (int x = 0; x < region.rect.width; ++x, ++node) {
        const std::size_t i = grid.index(region.rect.x + x, region.rect.y + y);
        if (labels[node] == object && region.distance(y, x) < nearest[i]) {
          objects[i] = region.label;
          nearest[i] = region.distance(y, x);
        } else if (labels[node] == uncertain && objects[i] == 0) {
          objects[i] = kUncertain;
        }
      }
  }
  return objects;
}

}  // namespace swarmfit::perception
