// One graph cut for all spaces of interest: depth decides where there is depth, colour where there is none or where the depth is in doubt,
// and neighbours compete for pixels in one energy. Only a band around what is in doubt is cut.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include <opencv2/imgproc.hpp>

#include "host/common/graph_cut.hpp"
#include "host/common/parallel.hpp"
#include "host/perception/grid.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

using Label = common::PottsEnergy::Label;
constexpr Label kBackground = 0;
constexpr double kDearest = 8;             // above any cost below
constexpr int kFixed = -1, kOutside = -2;  // instead of a node's number
constexpr int kNodesAtOnce = 1024;         // of a range that one thread works on

/// exp(-x) for x in [0, 16), by steps.
constexpr int kContrastSteps = 64;
const std::vector<double>& contrast_table() {
  static const std::vector<double> table = [] {
    std::vector<double> values(16 * kContrastSteps);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::exp(-(static_cast<double>(i) + 0.5) / kContrastSteps);
    return values;
  }();
  return table;
}

/// The supporting plane as seen within one SOI: its own points, fitted anew, tell height from noise better than the whole plane does.
struct SoiPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0, sigma = 0;
  double height(const Eigen::Vector3d& x) const { return normal.dot(x) + offset; }
};

class FusedCut {
 public:
  FusedCut(const SegmentationInput& input, const PerceiveOptions& options, const FusedTuning& tuning)
      : input_(input), options_(options), tuning_(tuning), grid_(input.frame) {
    const double scale = grid_.width() / 640.0;
    band_ = tuning.band * scale;
    reach_ = tuning.reach * scale;
    regions_ = soi_regions(input, grid_, options.soi_margin, static_cast<int>(std::ceil(reach_)), options.fit.threads);
    if (options.smoothness > 0) tuning_.smoothness = options.smoothness;
    if (options.uncertain_cost > 0) tuning_.uncertain = options.uncertain_cost;
  }

  std::vector<std::uint16_t> run() {
    find_nodes();
    if (active_.empty()) return std::move(labels_);
    find_candidates();
    find_pairs();
    build_energy();
    energy_.close();
    std::vector<Label> order;
    for (const SoiRegion& region : regions_)
      if (region.label != 0) order.push_back(region.label);
    order.push_back(kUncertain);
    order.push_back(kBackground);
    std::vector<Label> cut = energy_.cheapest();
    energy_.minimise(order, 1, cut, options_.fit.threads);  // more move next to nothing
    for (std::size_t n = 0; n < active_.size(); ++n) labels_[active_[n]] = cut[n];
    return std::move(labels_);
  }

 private:
  /// What it costs a node to belong to one SOI's object, and what to belong to the background around it.
  struct Candidate {
    std::int32_t node;
    Label label;
    std::int32_t object, background;
  };
  struct Pair {
    std::int32_t p;    // node
    std::size_t q;     // pixel
    float difference;  // of the colours, squared
    bool jump;         // the depth breaks between them
  };
  /// Pairs of consecutive nodes.
  struct PairRange {
    std::vector<Pair> pairs;
    double difference = 0;  // sum
  };

  void for_regions(const std::function<void(std::size_t)>& body) const {
    common::in_parallel(static_cast<int>(regions_.size()), 1, options_.fit.threads, [&](int first, int last) {
      for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k)
        if (regions_[k].label != 0) body(k);
    });
  }

  /// Settles what the depth leaves no doubt about; the rest become nodes.
  void find_nodes() {
    labels_.assign(grid_.size(), kBackground);
    node_.assign(grid_.size(), kOutside);
    std::vector<cv::Mat1b> doubtful(regions_.size());
    for_regions([&](std::size_t k) { doubtful[k] = find_doubtful(regions_[k]); });
    for (const SoiRegion& region : regions_) {
      if (region.label == 0) continue;
      const cv::Mat1b& in_doubt = doubtful[region.label - 1U];
      for (int y = 0; y < region.rect.height; ++y)
        for (int x = 0; x < region.rect.width; ++x) {
          const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
          if (input_.popout[i] == region.label) {
            labels_[i] = region.label;
            node_[i] = in_doubt(y, x) != 0 ? 0 : kFixed;
          } else if (in_doubt(y, x) != 0) {
            node_[i] = 0;
          }
        }
    }
    cv::Rect all;
    for (const SoiRegion& region : regions_) all |= region.rect;
    for (int v = all.y; v < all.br().y; ++v)
      for (std::size_t i = grid_.index(all.x, v); i < grid_.index(all.br().x, v); ++i)
        if (node_[i] == 0) {
          node_[i] = static_cast<int>(active_.size());
          active_.push_back(i);
        }
  }

  /// Pixels of a group are settled where all depth around is of the same group; pixels of none where they are too far off.
  cv::Mat1b find_doubtful(const SoiRegion& region) const {
    cv::Mat1b strange(region.rect.size()), near_strange;
    for (int y = 0; y < region.rect.height; ++y)
      for (int x = 0; x < region.rect.width; ++x) {
        const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
        strange(y, x) = input_.popout[i] != region.label && grid_.finite(i) ? 255 : 0;
      }
    cv::dilate(strange, near_strange, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
    for (int y = 0; y < region.rect.height; ++y)
      for (int x = 0; x < region.rect.width; ++x) {
        const std::uint16_t own = input_.popout[grid_.index(region.rect.x + x, region.rect.y + y)];
        if (own == region.label) continue;
        near_strange(y, x) = own == 0 && region.distance(y, x) <= (strange(y, x) != 0 ? band_ : reach_) ? 255 : 0;
      }
    return near_strange;
  }

  std::optional<SoiPlane> plane_within(const SoiRegion& region) const {
    const int plane = input_.sois[region.label - 1U].plane;
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d group = Eigen::Vector3d::Zero();
    std::size_t group_size = 0;
    const int step = std::max(1, static_cast<int>(std::sqrt(region.rect.area() / 4000.0)));
    for (int y = 0; y < region.rect.height; y += step)
      for (int x = 0; x < region.rect.width; x += step) {
        const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
        if (!grid_.finite(i)) continue;
        if (input_.popout[i] == region.label) {
          group += grid_.point(i);
          ++group_size;
        } else if (input_.popout[i] == 0 && input_.plane_labels[i] == plane && plane > 0) {
          points.push_back(grid_.point(i));
        }
      }
    if (points.size() < 100 || group_size == 0) return std::nullopt;
    const Eigen::Vector3d inside = group / static_cast<double>(group_size);
    SoiPlane fitted{};
    // Twice: what lies off the first fit is left out of the second.
    for (int round = 0; round < 2; ++round) {
      if (round > 0) std::erase_if(points, [&](const Eigen::Vector3d& x) { return !(std::abs(fitted.height(x)) < 2.5 * fitted.sigma); });
      const PlaneFit fit = perception::fit_plane(points, fitted.normal);
      fitted = {fit.normal, -fit.normal.dot(fit.mean), std::max(std::sqrt(fit.square), 1e-4)};
    }
    if (fitted.height(inside) < 0) fitted = {-fitted.normal, -fitted.offset, fitted.sigma};
    return fitted;
  }

  void find_candidates() {
    std::vector<std::vector<Candidate>> found(regions_.size());
    planes_.resize(regions_.size());
    for_regions([&](std::size_t k) {
      const SoiRegion& region = regions_[k];
      planes_[k] = plane_within(region);
      SoiColours colours = soi_colours(input_, grid_, region, options_.colour_neighbours, 4, tuning_.largest_sample);
      const auto for_candidates = [&](const auto& body) {
        for (int y = 0; y < region.rect.height; ++y)
          for (int x = 0; x < region.rect.width; ++x) {
            const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
            if (node_[i] >= 0 && region.distance(y, x) <= reach_) body(i, region.distance(y, x));
          }
      };
      for_candidates([&](std::size_t i, float) { colours.want(grid_.rgb(i)); });
      colours.settle(input_.colours);
      for_candidates([&](std::size_t i, float far) { found[k].push_back(weigh(region, i, static_cast<double>(far), colours)); });
    });
    // From region by region to node by node.
    first_candidate_.assign(active_.size() + 1, 0);
    for (const auto& of_region : found)
      for (const Candidate& c : of_region) ++first_candidate_[static_cast<std::size_t>(c.node) + 1];
    std::partial_sum(first_candidate_.begin(), first_candidate_.end(), first_candidate_.begin());
    candidates_.resize(first_candidate_.back());
    std::vector<std::size_t> next(first_candidate_.begin(), first_candidate_.end() - 1);
    for (const auto& of_region : found)
      for (const Candidate& c : of_region) candidates_[next[static_cast<std::size_t>(c.node)]++] = c;
  }

  Candidate weigh(const SoiRegion& region, std::size_t i, double far, SoiColours& colours) const {
    const std::uint8_t* rgb = grid_.rgb(i);
    const double as_object = colours.object.cost(rgb[0], rgb[1], rgb[2]), as_background = colours.background.cost(rgb[0], rgb[1], rgb[2]);
    // Shares of the sum tell more than the distances themselves.
    const double sum = as_object + as_background + tuning_.colour_floor;
    const double object_share = (as_object + tuning_.colour_floor / 2) / sum, background_share = 1 - object_share;
    // A colour that neither sample knows makes both dear, so that the third label is cheapest.
    const double alien = tuning_.alien * std::min(as_object, as_background);
    double object = object_share + tuning_.spatial * far / reach_ + alien;
    double background = background_share + alien;
    if (grid_.finite(i)) {
      const double risen = rise(region, i);  // 0 on the plane, 1 off it
      object = tuning_.colour_with_depth * object + tuning_.depth * (1 - risen);
      background = tuning_.colour_with_depth * background + tuning_.depth * risen;
      if (input_.popout[i] != 0 && input_.popout[i] != region.label) object += tuning_.depth;
    }
    return {node_[i], region.label, static_cast<std::int32_t>(to_cost(object)), static_cast<std::int32_t>(to_cost(background))};
  }

  void find_pairs() {
    const int count = static_cast<int>(active_.size());
    std::vector<Hls> colours(active_.size());
    pairs_.resize(static_cast<std::size_t>((count + kNodesAtOnce - 1) / kNodesAtOnce));
    const auto colour = [&](std::size_t i) { return to_hls(grid_.rgb(i)[0], grid_.rgb(i)[1], grid_.rgb(i)[2]); };
    common::in_parallel(count, kNodesAtOnce, options_.fit.threads, [&](int first, int last) {
      for (int n = first; n < last; ++n) colours[static_cast<std::size_t>(n)] = colour(active_[static_cast<std::size_t>(n)]);
    });
    common::in_parallel(count, kNodesAtOnce, options_.fit.threads, [&](int first, int last) {
      PairRange& range = pairs_[static_cast<std::size_t>(first / kNodesAtOnce)];
      range.pairs.reserve(static_cast<std::size_t>(3 * (last - first)));
      for (int n = first; n < last; ++n)
        visit_neighbours(n, [&](std::size_t q) {
          const float d = colour_distance(colours[static_cast<std::size_t>(n)],
                                          node_[q] >= 0 ? colours[static_cast<std::size_t>(node_[q])] : colour(q));
          range.pairs.push_back({n, q, d * d, jumps(active_[static_cast<std::size_t>(n)], q)});
          range.difference += static_cast<double>(d * d);
        });
    });
  }

  /// visit(pixel) for the four around a node; of two nodes only the first has the second.
  template <class Visit>
  void visit_neighbours(int node, Visit&& visit) const {
    constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    const std::size_t p = active_[static_cast<std::size_t>(node)], width = static_cast<std::size_t>(grid_.width());
    const int u = static_cast<int>(p % width), v = static_cast<int>(p / width);
    for (std::size_t d = 0; d < kAround.size(); ++d) {
      const int x = u + kAround[d][0], y = v + kAround[d][1];
      if (x < 0 || y < 0 || x >= grid_.width() || y >= grid_.height()) continue;
      const std::size_t q = grid_.index(x, y);
      if (d < 2 || node_[q] < 0) visit(q);  // else it is seen from the other end
    }
  }

  bool jumps(std::size_t p, std::size_t q) const {
    if (!grid_.finite(p) || !grid_.finite(q)) return false;
    const double z = grid_.point(p).z();
    return std::abs(z - grid_.point(q).z()) > std::max(options_.flood_step, 0.01 * z * z);
  }

  void build_energy() {
    double sum = 0;
    std::size_t count = 0;
    for (const PairRange& range : pairs_) {
      sum += range.difference;
      count += range.pairs.size();
    }
    const double beta = count == 0 || sum <= 0 ? 0 : static_cast<double>(count) / (2 * sum);
    energy_.reserve(active_.size(), candidates_.size() + 2 * active_.size(), count);
    int n = 0;
    for (const PairRange& range : pairs_) {
      auto next = range.pairs.begin();
      for (int k = 0; k < kNodesAtOnce && n < static_cast<int>(active_.size()); ++k, ++n) {
        const auto first = next;
        next = std::find_if(first, range.pairs.end(), [&](const Pair& pair) { return pair.p != n; });
        add_node(n, {first, next}, beta);
      }
    }
  }

  void add_node(int n, std::span<const Pair> pairs, double beta) {
    energy_.add_node();
    // A settled neighbour speaks for its label in the node's own costs.
    votes_.clear();
    for (const Pair& pair : pairs) {
      const common::PottsEnergy::Cost cost = boundary_cost(pair, beta);
      if (node_[pair.q] >= 0)
        energy_.add_edge(n, node_[pair.q], cost);
      else
        votes_.emplace_back(labels_[pair.q], cost);
    }
    const auto vote = [&](Label label) {
      common::PottsEnergy::Cost against = 0;
      for (const auto& [wanted, cost] : votes_)
        if (wanted != label) against += cost;
      return against;
    };
    auto background = static_cast<std::int32_t>(to_cost(kDearest));
    for (std::size_t c = first_candidate_[static_cast<std::size_t>(n)]; c < first_candidate_[static_cast<std::size_t>(n) + 1]; ++c) {
      background = std::min(background, candidates_[c].background);
      energy_.add_label(candidates_[c].label, candidates_[c].object + vote(candidates_[c].label));
    }
    energy_.add_label(kBackground, background + vote(kBackground));
    if (!grid_.finite(active_[static_cast<std::size_t>(n)])) energy_.add_label(kUncertain, to_cost(tuning_.uncertain) + vote(kUncertain));
  }

  common::PottsEnergy::Cost boundary_cost(const Pair& pair, double beta) const {
    const double steps = beta * static_cast<double>(pair.difference) * kContrastSteps;
    const double contrast = steps < 16 * kContrastSteps ? contrast_table()[static_cast<std::size_t>(steps)] : 0;
    const double share = tuning_.flat + (1 - tuning_.flat) * contrast;
    return to_cost(tuning_.smoothness * share * (pair.jump ? tuning_.at_jump : 1));
  }

  /// How surely a seen pixel lies off the SOI's plane, in [0, 1].
  double rise(const SoiRegion& region, std::size_t i) const {
    if (input_.popout[i] == region.label) return 1;
    const auto& plane = planes_[region.label - 1U];
    const SpaceOfInterest& soi = input_.sois[region.label - 1U];
    // What lies outside the space of interest is something else.
    if (!plane || (grid_.point(i) - soi.centre).norm() > soi.radius) return 0;
    const double height = mean_height(*plane, i), from = tuning_.rise_from * plane->sigma;
    if (height < -2 * options_.min_height) return 0;
    return std::clamp((height - from) / std::max(options_.min_height - from, 1e-4), 0.0, 1.0);
  }

  /// Of the pixel and its neighbours that are in no group: noise, but not a step, goes away.
  double mean_height(const SoiPlane& plane, std::size_t i) const {
    const int u = static_cast<int>(i % static_cast<std::size_t>(grid_.width())),
              v = static_cast<int>(i / static_cast<std::size_t>(grid_.width()));
    double sum = 0, count = 0;
    const double centre = plane.height(grid_.point(i));
    for (int y = std::max(v - 1, 0); y <= std::min(v + 1, grid_.height() - 1); ++y)
      for (int x = std::max(u - 1, 0); x <= std::min(u + 1, grid_.width() - 1); ++x) {
        const std::size_t j = grid_.index(x, y);
        if (input_.popout[j] != 0 || !grid_.finite(j)) continue;
        const double height = plane.height(grid_.point(j));
        if (std::abs(height - centre) > options_.flood_step) continue;
        sum += height;
        ++count;
      }
    return count > 0 ? sum / count : centre;
  }

  const SegmentationInput& input_;
  const PerceiveOptions& options_;
  FusedTuning tuning_;
  PixelGrid grid_;
  double band_ = 0, reach_ = 0;  // [px]
  std::vector<SoiRegion> regions_;
  std::vector<std::uint16_t> labels_;
  std::vector<int> node_;            // one a pixel: its node, kFixed or kOutside
  std::vector<std::size_t> active_;  // one a node: its pixel
  std::vector<std::optional<SoiPlane>> planes_;
  std::vector<Candidate> candidates_;         // node by node
  std::vector<std::size_t> first_candidate_;  // of each node
  std::vector<PairRange> pairs_;
  std::vector<std::pair<Label, common::PottsEnergy::Cost>> votes_;
  common::PottsEnergy energy_;
};

}  // namespace

std::vector<std::uint16_t> segment_fused(const SegmentationInput& input, const PerceiveOptions& options, const FusedTuning& tuning) {
  return FusedCut(input, options, tuning).run();
}

}  // namespace swarmfit::perception
