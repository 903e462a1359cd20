// One graph cut for all spaces of interest: depth decides where there is depth, colour where there is none or where the depth is in doubt,
// and neighbours compete for pixels in one energy. Only a band around what is in doubt is cut.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

#include "host/perception/graph_cut.hpp"
#include "host/perception/segmentation_grid.hpp"

namespace swarmfit::perception {
namespace {

using Label = PottsEnergy::Label;
constexpr Label kBackground = 0;
constexpr double kDearest = 8;             // above any cost below
constexpr int kFixed = -1, kOutside = -2;  // instead of a node's number

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
struct LocalPlane {
  Eigen::Vector3d normal;
  double offset, sigma;
  double height(const Eigen::Vector3d& x) const { return normal.dot(x) + offset; }
};

class FusedCut {
 public:
  FusedCut(const SegmentationInput& input, const PerceiveOptions& options, const FusedTuning& tuning)
      : input_(input), options_(options), tuning_(tuning), grid_(input.frame) {
    const double scale = grid_.width() / 640.0;
    band_ = tuning.band * scale;
    reach_ = tuning.reach * scale;
    regions_ = soi_regions(input, grid_, options.soi_margin, static_cast<int>(std::ceil(reach_)));
    if (options.smoothness > 0) tuning_.smoothness = options.smoothness;
    if (options.uncertain_cost > 0) tuning_.uncertain = options.uncertain_cost;
  }

  std::vector<std::uint16_t> run() {
    find_nodes();
    if (active_.empty()) return std::move(labels_);
    for (const SoiRegion& region : regions_) {
      planes_.push_back(region.label != 0 ? fit_plane(region) : std::nullopt);
      if (region.label != 0) {
        colours_.push_back(soi_colours(input_, grid_, region, options_.colour_neighbours, 4, tuning_.largest_sample));
      } else {
        colours_.emplace_back();
      }
    }
    find_pairs();
    build_energy();
    energy_.close();
    std::vector<Label> cut = energy_.cheapest();
    std::vector<Label> order;
    for (const SoiRegion& region : regions_)
      if (region.label != 0) order.push_back(region.label);
    order.push_back(kBackground);
    order.push_back(kUncertain);
    energy_.minimise(order, 3, cut);
    for (std::size_t n = 0; n < active_.size(); ++n) labels_[active_[n]] = cut[n];
    return std::move(labels_);
  }

 private:
  struct Pair {
    std::size_t p, q;
    float difference;  // of the colours, squared
    float length;      // [px]
    bool jump;         // the depth breaks between them
  };

  float distance(const SoiRegion& region, std::size_t i) const {
    const cv::Point at(static_cast<int>(i % static_cast<std::size_t>(grid_.width())),
                       static_cast<int>(i / static_cast<std::size_t>(grid_.width())));
    return region.rect.contains(at) ? region.distance(at - region.rect.tl()) : 1e9f;
  }

  /// Settles what the depth leaves no doubt about; the rest become nodes.
  void find_nodes() {
    labels_.assign(grid_.size(), kBackground);
    node_.assign(grid_.size(), kOutside);
    for (const SoiRegion& region : regions_) {
      if (region.label == 0) continue;
      // A pixel of the group is settled where all depth around is of the same group.
      cv::Mat1b strange(region.rect.size()), near_strange;
      for (int y = 0; y < region.rect.height; ++y)
        for (int x = 0; x < region.rect.width; ++x) {
          const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
          strange(y, x) = input_.popout[i] != region.label && grid_.finite(i) ? 255 : 0;
        }
      cv::dilate(strange, near_strange, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
      for (int y = 0; y < region.rect.height; ++y)
        for (int x = 0; x < region.rect.width; ++x) {
          const std::size_t i = grid_.index(region.rect.x + x, region.rect.y + y);
          const std::uint16_t own = input_.popout[i];
          if (own == region.label) {
            labels_[i] = own;
            node_[i] = near_strange(y, x) == 0 ? kFixed : 0;
          } else if (own == 0 && region.distance(y, x) <= (strange(y, x) != 0 ? band_ : reach_)) {
            node_[i] = 0;
          }
        }
    }
    for (std::size_t i = 0; i < node_.size(); ++i)
      if (node_[i] == 0) {
        node_[i] = static_cast<int>(active_.size());
        active_.push_back(i);
      }
  }

  std::optional<LocalPlane> fit_plane(const SoiRegion& region) const {
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
    LocalPlane fitted{};
    // Twice: what lies off the first fit is left out of the second.
    for (int round = 0; round < 2; ++round) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
      double count = 0, square = 0;
      const auto kept = [&](const Eigen::Vector3d& x) { return round == 0 || std::abs(fitted.height(x)) < 2.5 * fitted.sigma; };
      for (const auto& x : points)
        if (kept(x)) {
          mean += x;
          ++count;
        }
      mean /= count;
      for (const auto& x : points)
        if (kept(x)) spread += (x - mean) * (x - mean).transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
      square = std::max(solver.eigenvalues()[0], 0.0) / count;
      const Eigen::Vector3d normal = solver.eigenvectors().col(0);
      fitted = {normal, -normal.dot(mean), std::max(std::sqrt(square), 1e-4)};
    }
    if (fitted.height(group / static_cast<double>(group_size)) < 0) fitted = {-fitted.normal, -fitted.offset, fitted.sigma};
    return fitted;
  }

  void find_pairs() {
    // Left as it comes from the system: only the pages around objects are ever touched.
    const std::unique_ptr<Hls[]> hls(new Hls[grid_.size()]);
    std::vector<bool> known(grid_.size());
    const auto colour = [&](std::size_t i) -> const Hls& {
      if (!known[i]) {
        hls[i] = to_hls(grid_.rgb(i)[0], grid_.rgb(i)[1], grid_.rgb(i)[2]);
        known[i] = true;
      }
      return hls[i];
    };
    pairs_.reserve(5 * active_.size());
    constexpr std::array<std::array<int, 2>, 8> around = {{{1, 0}, {-1, 1}, {0, 1}, {1, 1}, {-1, 0}, {1, -1}, {0, -1}, {-1, -1}}};
    for (const std::size_t p : active_) {
      const int u = static_cast<int>(p % static_cast<std::size_t>(grid_.width())),
                v = static_cast<int>(p / static_cast<std::size_t>(grid_.width()));
      for (std::size_t d = 0; d < around.size(); ++d) {
        const int x = u + around[d][0], y = v + around[d][1];
        if (x < 0 || y < 0 || x >= grid_.width() || y >= grid_.height()) continue;
        const std::size_t q = grid_.index(x, y);
        if (d >= 4 && node_[q] >= 0) continue;  // seen from the other end
        const float difference = colour_distance(colour(p), colour(q));
        bool jump = false;
        if (grid_.finite(p) && grid_.finite(q)) {
          const double z = grid_.point(p).z();
          jump = std::abs(z - grid_.point(q).z()) > std::max(options_.flood_step, 0.01 * z * z);
        }
        pairs_.push_back({p, q, difference * difference, d % 4 == 1 || d % 4 == 3 ? 1.41421356f : 1.0f, jump});
      }
    }
  }

  void build_energy() {
    double mean = 0;
    for (const Pair& pair : pairs_) mean += pair.difference;
    const double beta = pairs_.empty() || mean <= 0 ? 0 : static_cast<double>(pairs_.size()) / (2 * mean);
    const auto cost_of = [&](const Pair& pair) {
      const double steps = beta * pair.difference * kContrastSteps;
      const double contrast = steps < 16 * kContrastSteps ? contrast_table()[static_cast<std::size_t>(steps)] : 0;
      return to_cost(tuning_.smoothness * (tuning_.flat + (1 - tuning_.flat) * contrast) * (pair.jump ? tuning_.at_jump : 1) / pair.length);
    };
    std::vector<std::pair<Label, PottsEnergy::Cost>> votes;
    auto pair = pairs_.begin();
    for (std::size_t n = 0; n < active_.size(); ++n) {
      energy_.add_node();
      // A settled neighbour speaks for its label in the node's own costs.
      votes.clear();
      for (; pair != pairs_.end() && pair->p == active_[n]; ++pair) {
        if (node_[pair->q] >= 0) {
          energy_.add_edge(static_cast<int>(n), node_[pair->q], cost_of(*pair));
        } else {
          votes.emplace_back(labels_[pair->q], cost_of(*pair));
        }
      }
      const auto vote = [&](Label label) {
        PottsEnergy::Cost against = 0;
        for (const auto& [wanted, cost] : votes)
          if (wanted != label) against += cost;
        return against;
      };
      const std::size_t i = active_[n];
      const std::uint8_t* rgb = grid_.rgb(i);
      double background = kDearest;
      const bool seen = grid_.finite(i);
      for (const SoiRegion& region : regions_) {
        if (region.label == 0) continue;
        const double far = distance(region, i);
        if (far > reach_) continue;
        SoiColours& colours = colours_[region.label - 1U];
        const double as_object = colours.object.cost(rgb[0], rgb[1], rgb[2]),
                     as_background = colours.background.cost(rgb[0], rgb[1], rgb[2]);
        // Shares of the sum tell more than the distances themselves.
        const double sum = as_object + as_background + tuning_.colour_floor;
        const double object_share = (as_object + tuning_.colour_floor / 2) / sum, background_share = 1 - object_share;
        // A colour that neither sample knows makes both dear, so that the third label is cheapest.
        const double alien = tuning_.alien * std::min(as_object, as_background);
        double object = object_share + tuning_.spatial * far / reach_ + alien;
        double here = background_share + alien;
        if (seen) {
          const double risen = rise(region, i);  // 0 on the plane, 1 off it
          object = tuning_.colour_with_depth * object + tuning_.depth * (1 - risen);
          here = tuning_.colour_with_depth * here + tuning_.depth * risen;
          if (input_.popout[i] != 0 && input_.popout[i] != region.label) object += tuning_.depth;
        }
        background = std::min(background, here);
        energy_.add_label(region.label, to_cost(object) + vote(region.label));
      }
      energy_.add_label(kBackground, to_cost(background) + vote(kBackground));
      if (!seen) energy_.add_label(kUncertain, to_cost(tuning_.uncertain) + vote(kUncertain));
    }
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
  double mean_height(const LocalPlane& plane, std::size_t i) const {
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
  std::vector<std::optional<LocalPlane>> planes_;
  std::vector<SoiColours> colours_;
  std::vector<Pair> pairs_;
  PottsEnergy energy_;
};

}  // namespace

std::vector<std::uint16_t> segment_fused(const SegmentationInput& input, const PerceiveOptions& options, const FusedTuning& tuning) {
  return FusedCut(input, options, tuning).run();
}

}  // namespace swarmfit::perception
