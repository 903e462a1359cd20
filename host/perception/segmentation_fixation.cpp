// Segmentation with fixation, after Mishra, Aloimonos and Cheong (2009): the optimal closed contour around a point within each object. In
// log-polar coordinates about that point a contour of any size is as long as any other, so that none is preferred for being short.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "host/common/min_cut.hpp"
#include "host/common/parallel.hpp"
#include "host/perception/boundary.hpp"
#include "host/perception/polar_grid.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

// Chosen on labelled Kinect frames. Lengths are for 640 columns.
constexpr double kSharpness = 5;       // eta: a certain border costs exp(-eta) of what a contour through plain ground does
constexpr double kDepthBorder = 0.95;  // probability of a border where the depth has one
constexpr double kInSurface = 0.2;     // share of the picture's probability that is left within one seen surface
constexpr double kAcross = 5;          // a contour across the thing's own points pays so many times as much
constexpr double kColour = 0.25;       // of the regions' colours in the second cut, beside a border's cost
constexpr double kColourSeen = 0.1;    // share of that where the depth is known
constexpr double kReach = 20;          // [px] what is farther from all points of the thing is not part of it
constexpr double kWellWithin = 0.4;    // of a piece's greatest depth: its fixation lies at least so deep in it
constexpr double kAround = 0.5;        // of its distance from the border: what is nearer to the fixation goes with it
constexpr double kLeastPiece = 0.05;   // of a group's points: smaller pieces have no fixation of their own
constexpr int kColourBits = 4;
constexpr std::size_t kLargestSample = 128;

class FixationCut {
 public:
  FixationCut(const SegmentationInput& input, const PixelGrid& grid, const cv::Mat1f& boundary, const SoiRegion& region,
              const Fixation& fixation, const PerceiveOptions& options)
      : input_(input),
        grid_(grid),
        boundary_(boundary),
        region_(region),
        options_(options),
        rect_(fixation.rect),
        polar_(fixation.at, fixation.rect, kAround * fixation.clear),
        graph_(polar_.make_graph()) {
    find_cells();
  }

  /// 255 within the contour, at the size of the fixation's rectangle.
  cv::Mat1b run() {
    cut({});
    const cv::Mat1b inside = to_image();
    cut(colour_costs(inside));
    return around_fixation(to_image());
  }

 private:
  enum class Side : std::uint8_t { unseen, off, on };         // as the depth has it
  enum class State : std::uint8_t { inside, open, outside };  // before the cut
  struct Cell {
    std::size_t pixel = 0;
    float picture = 0;  // probability of a border there
    Side side = Side::unseen;
    State state = State::outside;
  };

  void find_cells() {
    const double reach = kReach * grid_.width() / 640.0;
    cells_.resize(static_cast<std::size_t>(polar_.cells()));
    for (std::int32_t c = 0; c < polar_.cells(); ++c) {
      const cv::Point at = polar_.pixel(c);
      Cell& cell = cells_[static_cast<std::size_t>(c)];
      if (polar_.innermost(c)) cell.state = State::inside;
      // What the picture's edge cuts off ends there.
      const bool at_edge = at.x <= 0 || at.y <= 0 || at.x >= grid_.width() - 1 || at.y >= grid_.height() - 1;
      if (at_edge) cell.picture = 1;
      if (!rect_.contains(at)) continue;
      cell.pixel = grid_.index(at.x, at.y);
      if (!at_edge) cell.picture = boundary_(at);
      cell.side = input_.popout[cell.pixel] == region_.label ? Side::on : grid_.finite(cell.pixel) ? Side::off : Side::unseen;
      if (cell.state == State::outside && static_cast<double>(region_.distance(at - region_.rect.tl())) <= reach) cell.state = State::open;
      if (cell.state == State::open) open_.push_back(c);
    }
  }

  /// What a contour pays for running between two neighbouring cells.
  std::int32_t border_cost(const Cell& p, const Cell& q) const {
    double probability = 0.5 * static_cast<double>(p.picture + q.picture), dearer = 1;
    if (p.side != Side::unseen && q.side != Side::unseen) {
      probability = p.side == q.side ? kInSurface * probability : 1 - (1 - probability) * (1 - kDepthBorder);
      if (p.side == Side::on && q.side == Side::on) dearer = kAcross;
    }
    return static_cast<std::int32_t>(to_cost(dearer * std::exp(-kSharpness * probability)));
  }

  /// `outside_costs`: one an open cell, what speaks for the outside (> 0) or the inside; or none.
  void cut(const std::vector<std::int32_t>& outside_costs) {
    for (std::size_t n = 0; n < open_.size(); ++n) {
      const std::int32_t c = open_[n];
      std::int32_t terminal = outside_costs.empty() ? 0 : outside_costs[n];
      for (std::int32_t a = graph_.first_arc(c); a < graph_.last_arc(c); ++a) {
        const Cell &here = cells_[static_cast<std::size_t>(c)], &there = cells_[static_cast<std::size_t>(graph_.arc(a).head)];
        const std::int32_t cost = border_cost(here, there);
        graph_.capacity(a) = there.state == State::open ? cost : 0;
        if (there.state == State::open) continue;
        graph_.capacity(graph_.arc(a).mate) = 0;
        terminal += there.state == State::outside ? cost : -cost;  // the inside is at the sink
      }
      graph_.terminal(c) = terminal;
    }
    graph_.cut(open_);
  }

  bool inside(std::int32_t c) const {
    const State state = cells_[static_cast<std::size_t>(c)].state;
    return state == State::inside || (state == State::open && graph_.at_sink(c));
  }

  cv::Mat1b to_image() const {
    cv::Mat1b image(rect_.size());
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) image(y, x) = inside(polar_.cell(rect_.tl() + cv::Point(x, y))) ? 255 : 0;
    return image;
  }

  /// By the colours that the first contour parts.
  std::vector<std::int32_t> colour_costs(const cv::Mat1b& within) const {
    ColourSample in(options_.colour_neighbours, kColourBits), out(options_.colour_neighbours, kColourBits);
    for (int y = 0; y < within.rows; ++y)
      for (int x = 0; x < within.cols; ++x) {
        const std::uint8_t* rgb = grid_.rgb(grid_.index(rect_.x + x, rect_.y + y));
        (within(y, x) != 0 ? in : out).add(rgb[0], rgb[1], rgb[2]);
      }
    for (ColourSample* sample : {&in, &out}) {
      sample->close(kLargestSample);
      for (const std::int32_t c : open_) {
        const std::uint8_t* rgb = grid_.rgb(cells_[static_cast<std::size_t>(c)].pixel);
        sample->want(rgb[0], rgb[1], rgb[2]);
      }
      sample->settle(input_.colours);
    }
    std::vector<std::int32_t> costs;
    costs.reserve(open_.size());
    for (const std::int32_t c : open_) {
      const Cell& cell = cells_[static_cast<std::size_t>(c)];
      const std::uint8_t* rgb = grid_.rgb(cell.pixel);
      constexpr float kLittle = 0.05f;  // two distances well below this tell nothing
      const float a = in.cost(rgb[0], rgb[1], rgb[2]), b = out.cost(rgb[0], rgb[1], rgb[2]);
      const double share = kColour * (cell.side == Side::unseen ? 1 : kColourSeen);
      costs.push_back(static_cast<std::int32_t>(to_cost(share * static_cast<double>((a - b) / (a + b + kLittle)))));
    }
    return costs;
  }

  /// The piece that holds the fixation.
  cv::Mat1b around_fixation(const cv::Mat1b& within) const {
    cv::Mat1i pieces;
    cv::connectedComponents(within, pieces, 4, CV_32S);
    return pieces == pieces(polar_.fixation() - rect_.tl());
  }

  const SegmentationInput& input_;
  const PixelGrid& grid_;
  const cv::Mat1f& boundary_;
  const SoiRegion& region_;
  const PerceiveOptions& options_;
  cv::Rect rect_;
  PolarGrid polar_;
  common::CutGraph graph_;
  std::vector<Cell> cells_;
  std::vector<std::int32_t> open_;
};

/// Within one piece: among the pixels well within it the one seen nearest to the SOI's centre. The centre of what is seen of a ring is not
/// on it, and a rim is no place to look at.
Fixation fixation_within(const cv::Mat1b& piece, const Eigen::Vector3d& centre, const PixelGrid& grid, cv::Point corner) {
  cv::Mat1b framed;
  cv::Mat1f depth;
  cv::copyMakeBorder(piece, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::distanceTransform(framed, depth, cv::DIST_L2, cv::DIST_MASK_3);
  double deepest = 0;
  cv::minMaxLoc(depth, nullptr, &deepest);
  const Eigen::Vector3d towards = centre.normalized();
  Fixation best;
  double most = -2;
  for (int y = 0; y < piece.rows; ++y)
    for (int x = 0; x < piece.cols; ++x) {
      const auto clear = static_cast<double>(depth(y + 1, x + 1));
      if (piece(y, x) == 0 || clear < kWellWithin * deepest) continue;
      const cv::Point pixel = corner + cv::Point(x, y);
      const double cosine = grid.point(grid.index(pixel.x, pixel.y)).normalized().dot(towards);
      if (cosine <= most) continue;
      most = cosine;
      best.at = pixel;
      best.clear = clear;
    }
  return best;
}

}  // namespace

std::vector<Fixation> find_fixations(const SegmentationInput& input, const PixelGrid& grid, const SoiRegion& region) {
  cv::Mat1b group(region.rect.size());
  for (int y = 0; y < group.rows; ++y)
    for (int x = 0; x < group.cols; ++x)
      group(y, x) = input.popout[grid.index(region.rect.x + x, region.rect.y + y)] == region.label ? 255 : 0;
  cv::Mat pieces, boxes, centroids;
  const int count = cv::connectedComponentsWithStats(group, pieces, boxes, centroids, 8, CV_32S);
  const double least = kLeastPiece * cv::countNonZero(group);
  const int border = static_cast<int>(std::ceil(kReach * grid.width() / 640.0));
  std::vector<Fixation> fixations;
  for (int k = 1; k < count; ++k) {
    if (boxes.at<int>(k, cv::CC_STAT_AREA) < least) continue;
    const cv::Rect box(boxes.at<int>(k, cv::CC_STAT_LEFT), boxes.at<int>(k, cv::CC_STAT_TOP), boxes.at<int>(k, cv::CC_STAT_WIDTH),
                       boxes.at<int>(k, cv::CC_STAT_HEIGHT));
    const cv::Mat1b piece = pieces(box) == k;
    fixations.push_back(fixation_within(piece, input.sois[region.label - 1U].centre, grid, region.rect.tl() + box.tl()));
    fixations.back().rect =
        cv::Rect(region.rect.x + box.x - border, region.rect.y + box.y - border, box.width + 2 * border, box.height + 2 * border) &
        region.rect;
  }
  return fixations;
}

std::vector<std::uint16_t> segment_fixation(const SegmentationInput& input, const PerceiveOptions& options) {
  const PixelGrid grid(input.frame);
  const cv::Mat1f boundary = boundary_probability(input.frame);
  const int border = static_cast<int>(std::ceil(kReach * grid.width() / 640.0));
  const auto regions = soi_regions(input, grid, options.soi_margin, border, options.fit.threads);
  struct Job {
    const SoiRegion* region;
    Fixation fixation;
    cv::Mat1b inside;
  };
  std::vector<Job> jobs;
  for (const SoiRegion& region : regions)
    if (region.label != 0)
      for (const Fixation& fixation : find_fixations(input, grid, region)) jobs.push_back({&region, fixation, {}});
  common::in_parallel(static_cast<int>(jobs.size()), 1, options.fit.threads, [&](int first, int last) {
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k)
      jobs[k].inside = FixationCut(input, grid, boundary, *jobs[k].region, jobs[k].fixation, options).run();
  });
  // A pixel within two contours goes to the one whose points are nearer.
  std::vector<std::uint16_t> objects(grid.size(), 0);
  std::vector<float> nearest(grid.size(), std::numeric_limits<float>::infinity());
  for (const Job& job : jobs) {
    const cv::Rect& rect = job.fixation.rect;
    for (int y = 0; y < rect.height; ++y)
      for (int x = 0; x < rect.width; ++x) {
        const std::size_t i = grid.index(rect.x + x, rect.y + y);
        const float distance = job.region->distance(rect.tl() + cv::Point(x, y) - job.region->rect.tl());
        if (job.inside(y, x) == 0 || distance >= nearest[i]) continue;
        objects[i] = job.region->label;
        nearest[i] = distance;
      }
  }
  return objects;
}

}  // namespace swarmfit::perception
