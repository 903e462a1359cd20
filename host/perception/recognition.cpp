#include "host/perception/recognition.hpp"

#include <algorithm>
#include <string>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "host/perception/gallery_index.hpp"
#include "host/perception/gallery_pictures.hpp"
#include "host/perception/recognition_match.hpp"

namespace swarmfit::perception {
namespace {

namespace fs = std::filesystem;

constexpr int kLeastArea = 400;  // [px] smaller proto-objects have too little print to be told by

struct View {
  std::string name;
  Features features;
};

/// One place of one view in the frame.
struct Candidate {
  const View* view;
  Placement placement;
};

/// All names in one proto-object: the best placement takes its points, the rest share what is left, until no view has enough.
std::vector<Recognition> name_object(std::span<const View> views, const Features& seen) {
  std::vector<std::vector<Match>> matches;
  for (const View& view : views) matches.push_back(match_features(view.features, seen));
  std::vector<Recognition> names;
  std::vector<bool> taken(seen.points.size());
  for (;;) {
    Candidate best{nullptr, {}};
    for (std::size_t v = 0; v < views.size(); ++v) {
      std::erase_if(matches[v], [&](const Match& m) { return taken[static_cast<std::size_t>(m.seen)]; });
      if (matches[v].size() < std::max(kLeastInliers, best.placement.inliers.size() + 1)) continue;
      Placement placement = place_view(views[v].features, seen, matches[v], kLeastInliers);
      if (placement.inliers.size() > best.placement.inliers.size()) best = {&views[v], std::move(placement)};
    }
    if (best.view == nullptr) return names;
    const auto count = best.placement.inliers.size();
    names.push_back({best.view->name, count, static_cast<double>(count) / (static_cast<double>(count) + 10)});
    // Everything under the placed view is explained, matched or not: no second name for the same surface.
    const cv::Size size = best.view->features.size;
    std::vector<cv::Point2f> outline;
    for (const auto& [x, y] : {std::pair{0, 0}, {size.width, 0}, {size.width, size.height}, {0, size.height}}) {
      const Eigen::Vector2d corner = (best.placement.view_to_frame * Eigen::Vector3d(x, y, 1)).hnormalized();
      outline.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
    }
    for (const Match& m : best.placement.inliers) taken[static_cast<std::size_t>(m.seen)] = true;
    for (std::size_t i = 0; i < seen.points.size(); ++i)
      if (cv::pointPolygonTest(outline, seen.points[i].pt, false) >= 0) taken[i] = true;
  }
}

}  // namespace

struct Gallery::State {
  std::vector<View> views;
};

Gallery::Gallery(std::unique_ptr<State> state) : state_(std::move(state)) {}
Gallery::~Gallery() = default;
Gallery::Gallery(Gallery&&) noexcept = default;
Gallery& Gallery::operator=(Gallery&&) noexcept = default;

Expected<Gallery> Gallery::load(const fs::path& folder) {
  auto state = std::make_unique<State>();
  const auto pictures = list_pictures(folder);
  if (!pictures) return tl::unexpected(pictures.error());
  auto index = GalleryIndex::read(folder);
  for (const auto& [name, file] : *pictures) {
    auto features = features_of(file, index);
    if (!features) return tl::unexpected(features.error());
    state->views.push_back({name, std::move(*features)});
  }
  return Gallery(std::move(state));
}

std::vector<std::vector<Recognition>> Gallery::recognise(const Cloud& frame, std::span<const std::uint16_t> objects,
                                                         std::size_t soi_count) const {
  std::vector<std::vector<Recognition>> names(soi_count);
  if (!frame.organised() || !frame.coloured() || objects.size() != frame.size()) return names;
  // OpenCV only reads.
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));
  cv::Mat1b grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  const cv::Mat1w labels(frame.height, frame.width, const_cast<std::uint16_t*>(objects.data()));
  for (std::size_t k = 1; k <= soi_count; ++k) {
    const cv::Mat1b mask = labels == static_cast<double>(k);
    cv::Rect box = cv::boundingRect(mask);
    if (box.empty() || cv::countNonZero(mask) < kLeastArea) continue;
    box = (box - cv::Point(kBorder, kBorder) + cv::Size(2 * kBorder, 2 * kBorder)) & cv::Rect({}, grey.size());
    cv::Mat1b patch = grey(box), inside = mask(box);
    look_closer(patch, inside);
    names[k - 1] = name_object(state_->views, find_features(patch, inside));
  }
  return names;
}

}  // namespace swarmfit::perception
