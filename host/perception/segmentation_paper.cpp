// The segmentation of Zhou et al. 2010, section IV: in each SOI's rectangle a graph cut over object, background and uncertain.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/common/graph_cut.hpp"
#include "host/common/parallel.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

// What the paper leaves open, chosen on labelled Kinect frames.
constexpr double kUncertainCost = 0.35;  // of the third label
constexpr double kSmoothness = 0.02;     // of a boundary between two pixels side by side
constexpr double kSpatialReach = 0.25;   // of the rectangle's shorter side: there the spatial cost is 1
constexpr std::size_t kLargestSample = 512;
constexpr int kColourBits = 5;
constexpr int kCycles = 5;

enum : common::PottsEnergy::Label { background, object, uncertain, open };
constexpr int kLabels = 3;
constexpr std::array<common::PottsEnergy::Label, kLabels> kOrder = {object, background, uncertain};

/// The cut within one rectangle. Where one label is cheaper than the others by more than all boundaries around a pixel weigh, it is settled
/// beforehand: no labelling of least energy has another there.
class PaperCut {
 public:
  PaperCut(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, const PerceiveOptions& options)
      : width_(region.rect.width), height_(region.rect.height) {
    const double smoothness = options.smoothness > 0 ? options.smoothness : kSmoothness;
    straight_ = to_cost(smoothness);
    slanted_ = to_cost(smoothness / std::sqrt(2.0));
    weigh_pixels(input, grid, region, options);
  }

  /// Labels of the rectangle's pixels, row after row.
  std::vector<common::PottsEnergy::Label> run() {
    node_.assign(labels_.size(), -1);
    int nodes = 0;
    for (std::size_t i = 0; i < labels_.size(); ++i)
      if (labels_[i] == open) node_[i] = nodes++;
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (node_[at(x, y)] >= 0) add_node(x, y);
    energy_.close();
    auto cut = energy_.cheapest();
    energy_.minimise(kOrder, kCycles, cut, 1);
    for (std::size_t i = 0; i < labels_.size(); ++i)
      if (node_[i] >= 0) labels_[i] = cut[static_cast<std::size_t>(node_[i])];
    return std::move(labels_);
  }

 private:
  using Costs = std::array<common::PottsEnergy::Cost, kLabels>;

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  /// A label that costs more than this above the cheapest is out of the question.
  common::PottsEnergy::Cost most_of_boundaries() const { return 4 * (straight_ + slanted_); }

  void weigh_pixels(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, const PerceiveOptions& options) {
    const PaperCosts weighed = paper_costs(input, grid, region, options);
    const auto uncertain_cost = to_cost(options.uncertain_cost > 0 ? options.uncertain_cost : kUncertainCost);
    costs_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    labels_.resize(costs_.size());
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        Costs& cost = costs_[at(x, y)];
        cost[background] = to_cost(weighed.background(y, x));
        cost[object] = to_cost(weighed.object(y, x));
        cost[uncertain] = uncertain_cost;
        const auto cheapest = std::min_element(cost.begin(), cost.end());
        const auto rivals =
            std::count_if(cost.begin(), cost.end(), [&](common::PottsEnergy::Cost c) { return c <= *cheapest + most_of_boundaries(); });
        labels_[at(x, y)] =
            rivals == 1 ? static_cast<common::PottsEnergy::Label>(cheapest - cost.begin()) : common::PottsEnergy::Label{open};
      }
  }

  /// Eight neighbours, each pair once. A settled one speaks for its label in the node's own costs.
  void add_node(int x, int y) {
    const std::size_t here = at(x, y);
    const int node = energy_.add_node();
    Costs cost = costs_[here];
    const common::PottsEnergy::Cost most = *std::min_element(cost.begin(), cost.end()) + most_of_boundaries();
    const Costs own = cost;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= width_ || y + dy >= height_) continue;
        const std::size_t to = at(x + dx, y + dy);
        const common::PottsEnergy::Cost weight = dx != 0 && dy != 0 ? slanted_ : straight_;
        if (node_[to] >= 0) {
          if (to < here) energy_.add_edge(node_[to], node, weight);
          continue;
        }
        for (std::size_t label = 0; label < cost.size(); ++label) cost[label] += label != labels_[to] ? weight : 0;
      }
    for (std::size_t label = 0; label < cost.size(); ++label)
      if (own[label] <= most) energy_.add_label(static_cast<common::PottsEnergy::Label>(label), cost[label]);
  }

  int width_, height_;
  common::PottsEnergy::Cost straight_ = 0, slanted_ = 0;  // of a boundary between pixels side by side, and across a corner
  std::vector<Costs> costs_;
  std::vector<common::PottsEnergy::Label> labels_;
  std::vector<int> node_;  // one a pixel, -1 where it is settled
  common::PottsEnergy energy_;
};

}  // namespace

PaperCosts paper_costs(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region, const PerceiveOptions& options) {
  SoiColours colours = soi_colours(input, grid, region, options.colour_neighbours, kColourBits, kLargestSample);
  const double reach = kSpatialReach * std::min(region.rect.width, region.rect.height);
  for (int y = 0; y < region.rect.height; ++y)
    for (int x = 0; x < region.rect.width; ++x) colours.want(grid.rgb(grid.index(region.rect.x + x, region.rect.y + y)));
  colours.settle(input.colours);
  PaperCosts costs{cv::Mat1d(region.rect.size()), cv::Mat1d(region.rect.size())};
  for (int y = 0; y < region.rect.height; ++y)
    for (int x = 0; x < region.rect.width; ++x) {
      const std::uint8_t* rgb = grid.rgb(grid.index(region.rect.x + x, region.rect.y + y));
      const double spatial = std::min(1.0, static_cast<double>(region.distance(y, x)) / reach);
      costs.background(y, x) = static_cast<double>(colours.background.cost(rgb[0], rgb[1], rgb[2]));
      costs.object(y, x) = static_cast<double>(colours.object.cost(rgb[0], rgb[1], rgb[2])) + spatial;
    }
  return costs;
}

std::vector<std::uint16_t> segment_paper(const SegmentationInput& input, const PerceiveOptions& options) {
  const PixelGrid grid(input.frame);
  std::vector<std::uint16_t> objects(grid.size(), 0);
  // A pixel that two SOIs claim goes to the one whose points are nearer.
  std::vector<float> nearest(grid.size(), std::numeric_limits<float>::infinity());
  const auto regions = soi_regions(input, grid, options.soi_margin, 2, options.fit.threads);
  std::vector<std::vector<common::PottsEnergy::Label>> cuts(regions.size());
  common::in_parallel(static_cast<int>(regions.size()), 1, options.fit.threads, [&](int first, int last) {
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k)
      if (regions[k].label != 0) cuts[k] = PaperCut(input, grid, regions[k], options).run();
  });
  for (const SoiRegion& region : regions) {
    if (region.label == 0) continue;
    const auto& labels = cuts[region.label - 1U];
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
