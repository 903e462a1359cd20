#include "host/perception/recognition.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/perception/recognition_match.hpp"

namespace swarmfit::perception {
namespace {

namespace fs = std::filesystem;

// Matches that must agree on one placement. Fewer came together by chance on wood grain and print that is in no gallery.
constexpr std::size_t kLeastInliers = 6;
constexpr int kLargestView = 640;  // [px] larger pictures are scaled down: nothing is seen so large
constexpr int kSmall = 128;        // [px] a proto-object smaller than this is looked at through a lens of two
constexpr int kLeastArea = 400;    // [px] smaller proto-objects have too little print to be told by
constexpr int kBorder = 12;        // [px] around a proto-object: SIFT's support beyond its outline

struct View {
  std::string name;
  Features features;
};

bool is_image(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static constexpr std::array<std::string_view, 9> known = {".png", ".jpg", ".jpeg", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

/// What a folder holds, by name, so that the order does not depend on the file system.
Expected<std::vector<fs::path>> entries(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator it(folder, error);
  if (error)
    return fail(Error::Kind::bad_input, fmt::format("gallery {}: cannot be read as a folder: {}", folder.string(), error.message()));
  std::vector<fs::path> found;
  for (; it != fs::directory_iterator(); it.increment(error)) {
    if (error) return fail(Error::Kind::bad_input, fmt::format("gallery {}: {}", folder.string(), error.message()));
    if (it->path().filename().string().front() != '.') found.push_back(it->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Where an image has transparency, only what is opaque belongs to the object.
Expected<View> read_view(const std::string& name, const fs::path& file) {
  // Decoded from memory: imread reports to stderr what it cannot open.
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  cv::Mat image;
  try {
    if (!bytes.empty()) image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) return fail(Error::Kind::bad_input, fmt::format("gallery image {}: cannot be read", file.string()));
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257);
  if (image.depth() != CV_8U)
    return fail(Error::Kind::bad_input, fmt::format("gallery image {}: neither 8 nor 16 bits a channel", file.string()));
  const int longest = std::max(image.rows, image.cols);
  if (longest > kLargestView) cv::resize(image, image, {}, 1.0 * kLargestView / longest, 1.0 * kLargestView / longest, cv::INTER_AREA);
  cv::Mat1b grey, mask;
  if (image.channels() == 4) {
    cv::extractChannel(image, mask, 3);
    mask = mask > 127;
    cv::cvtColor(image, grey, cv::COLOR_BGRA2GRAY);
  } else if (image.channels() == 3) {
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  } else {
    cv::extractChannel(image, grey, 0);
  }
  return View{name, find_features(grey, mask)};
}

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
  const auto top = entries(folder);
  if (!top) return tl::unexpected(top.error());
  std::vector<std::pair<std::string, fs::path>> images;
  for (const fs::path& entry : *top) {
    std::error_code ignored;
    if (fs::is_directory(entry, ignored)) {
      const auto inside = entries(entry);
      if (!inside) return tl::unexpected(inside.error());
      const std::size_t before = images.size();
      for (const fs::path& file : *inside)
        if (is_image(file)) images.emplace_back(entry.filename().string(), file);
      if (images.size() == before) return fail(Error::Kind::bad_input, fmt::format("gallery {}: holds no image", entry.string()));
    } else if (is_image(entry)) {
      images.emplace_back(entry.stem().string(), entry);
    }
  }
  if (images.empty())
    return fail(Error::Kind::bad_input, fmt::format("gallery {}: holds no image and no folder of images", folder.string()));
  for (const auto& [name, file] : images) {
    auto view = read_view(name, file);
    if (!view) return tl::unexpected(view.error());
    state->views.push_back(std::move(*view));
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
    if (std::max(box.width, box.height) < kSmall + 2 * kBorder) {
      cv::resize(grey(box), patch, {}, 2, 2, cv::INTER_CUBIC);
      cv::resize(mask(box), inside, {}, 2, 2, cv::INTER_NEAREST);
    }
    names[k - 1] = name_object(state_->views, find_features(patch, inside));
  }
  return names;
}

}  // namespace swarmfit::perception
