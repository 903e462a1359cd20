#include "host/perception/gallery_pictures.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "host/io/file.hpp"
#include "host/io/image.hpp"

namespace swarmfit::perception {
namespace {

namespace fs = std::filesystem;

constexpr int kLargestView = 640;  // [px] larger pictures are scaled down: nothing is seen so large
constexpr int kSmall = 128;        // [px] what is smaller is looked at through a lens

/// What a folder holds, by name, so that the order does not depend on the file system.
Expected<std::vector<fs::path>> entries(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator it(folder, error);
  if (error)
    return fail(Error::Kind::bad_input, fmt::format("gallery {}: cannot be read as a folder: {}", folder.string(), error.message()));
  std::vector<fs::path> found;
  for (; it != fs::directory_iterator(); it.increment(error)) {  // to the end where there is an error
    if (it->path().filename().string().front() != '.') found.push_back(it->path());
  }
  if (error) return fail(Error::Kind::bad_input, fmt::format("gallery {}: {}", folder.string(), error.message()));
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

bool is_image(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  // Also what cannot be read here: a gallery's picture is an error then, and not passed over.
  static constexpr std::array<std::string_view, 9> known = {".png", ".jpg", ".jpeg", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

Expected<std::vector<GalleryPicture>> list_pictures(const fs::path& folder) {
  const auto top = entries(folder);
  if (!top) return tl::unexpected(top.error());
  std::vector<GalleryPicture> pictures;
  for (const fs::path& entry : *top) {
    std::error_code ignored;
    if (fs::is_directory(entry, ignored)) {
      const auto inside = entries(entry);
      if (!inside) return tl::unexpected(inside.error());
      const std::size_t before = pictures.size();
      for (const fs::path& file : *inside)
        if (is_image(file)) pictures.push_back({entry.filename().string(), file});
      if (pictures.size() == before) return fail(Error::Kind::bad_input, fmt::format("gallery {}: holds no image", entry.string()));
    } else if (is_image(entry)) {
      pictures.push_back({entry.stem().string(), entry});
    }
  }
  if (pictures.empty())
    return fail(Error::Kind::bad_input, fmt::format("gallery {}: holds no image and no folder of images", folder.string()));
  return pictures;
}

Expected<std::string> read_picture(const fs::path& file) {
  const auto bytes = io::read_file(file);
  if (!bytes) return fail(bytes.error().kind, "gallery image " + bytes.error().message);
  return std::string(bytes->text());
}

Expected<Features> picture_features(const fs::path& file, std::string_view bytes) {
  const auto decoded = io::decode_image(file, bytes, true);
  if (!decoded) return fail(decoded.error().kind, "gallery image " + decoded.error().message);
  cv::Mat image = *decoded;
  const int longest = std::max(image.rows, image.cols);
  if (longest > kLargestView) cv::resize(image, image, {}, 1.0 * kLargestView / longest, 1.0 * kLargestView / longest, cv::INTER_AREA);
  cv::Mat1b grey, mask;
  if (image.channels() == 4) {
    cv::extractChannel(image, mask, 3);
    mask = mask > 127;
    cv::cvtColor(image, grey, cv::COLOR_RGBA2GRAY);
  } else {
    cv::cvtColor(image, grey, cv::COLOR_RGB2GRAY);
  }
  if (mask.empty()) mask = cv::Mat1b(grey.size(), 255);
  look_closer(grey, mask);
  return find_features(grey, mask);
}

Expected<Features> features_of(const fs::path& file, GalleryIndex& index) {
  const auto bytes = read_picture(file);
  if (!bytes) return tl::unexpected(bytes.error());
  if (const Features* known = index.find(*bytes)) return *known;
  auto features = picture_features(file, *bytes);
  if (!features) return tl::unexpected(features.error());
  return index.put(*bytes, std::move(*features));
}

void look_closer(cv::Mat1b& grey, cv::Mat1b& mask) {
  if (std::max(grey.cols, grey.rows) >= kSmall + 2 * kBorder) return;
  cv::Mat1b large, inside;
  cv::resize(grey, large, {}, 2, 2, cv::INTER_CUBIC);
  cv::resize(mask, inside, {}, 2, 2, cv::INTER_NEAREST);
  grey = large;
  mask = inside;
}

}  // namespace swarmfit::perception
