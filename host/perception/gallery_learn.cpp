// Views go into a gallery: the picture into its name's folder, its features into the index, or neither.
#include <swarmfit/gallery.hpp>

#include <algorithm>
#include <cstdint>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <swarmfit/results.hpp>

#include "host/common/thrown.hpp"
#include "host/io/file.hpp"
#include "host/io/png.hpp"
#include "host/perception/gallery_index.hpp"
#include "host/perception/gallery_pictures.hpp"

namespace swarmfit {
namespace {

namespace fs = std::filesystem;
using perception::GalleryIndex;

Expected<> check_name(const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(),
                                 [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f && c != '/' && c != '\\'; });
  if (!name.empty() && name.size() <= 200 && name.front() != '.' && plain) return {};
  return fail(Error::Kind::invalid_option,
              fmt::format("name is '{}', must be a folder's name: 1 to 200 characters, no / and no dot in front", name));
}

fs::path free_file(const fs::path& folder, const std::string& extension) {
  for (int k = 1;; ++k) {
    std::error_code ignored;
    fs::path file = folder / fmt::format("{:03}{}", k, extension);
    if (!fs::exists(file, ignored)) return file;
  }
}

/// All that can be read, so that the next who loads the gallery finds it ready.
Expected<> write_index(const fs::path& gallery, LearntView& learnt, const std::string& name) {
  const auto pictures = perception::list_pictures(gallery);
  if (!pictures) return tl::unexpected(pictures.error());
  auto index = GalleryIndex::read(gallery);
  std::set<std::string> names;
  for (const auto& picture : *pictures) {
    names.insert(picture.name);
    if (picture.name == name) ++learnt.views;
    if (const auto features = perception::features_of(picture.file, index); !features && picture.file == learnt.file)
      return tl::unexpected(features.error());
  }
  learnt.names = names.size();
  return index.write(gallery);
}

Expected<LearntView> add_view(const fs::path& gallery, const std::string& name, const std::string& picture, const std::string& extension,
                              const std::string& source) {
  if (auto ok = check_name(name); !ok) return tl::unexpected(ok.error());
  const auto features = perception::picture_features(source, picture);
  if (!features) return tl::unexpected(features.error());
  LearntView learnt;
  learnt.features = features->points.size();
  if (learnt.features < perception::kLeastInliers)
    return fail(Error::Kind::bad_input,
                fmt::format("{}: has {} features, must have >= {} to be known by", source, learnt.features, perception::kLeastInliers));
  const fs::path folder = gallery / name;
  std::error_code error;
  io::Tentative whole(gallery), named(folder);
  whole.is_new(!fs::exists(gallery, error));
  named.is_new(!fs::exists(folder, error));
  fs::create_directories(folder, error);
  if (error) return fail(Error::Kind::cannot_write, fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  learnt.file = free_file(folder, extension);
  io::Tentative view(learnt.file);
  view.is_new(true);
  auto done = write_text(learnt.file, picture);
  if (done) done = write_index(gallery, learnt, name);
  if (!done) return tl::unexpected(done.error());
  for (io::Tentative* one : {&whole, &named, &view}) one->keep();
  return learnt;
}

/// The k-th object's pixels, or those of the one with the most; k is set.
Expected<cv::Mat1b> object_mask(const Cloud& frame, const PerceiveResult& result, std::size_t& k) {
  if (!frame.organised() || !frame.coloured() || result.objects.size() != frame.size())
    return fail(Error::Kind::bad_input, "the frame has no colour or no image grid: nothing to learn from");
  std::vector<std::size_t> pixels(result.sois.size() + 1);
  for (const auto label : result.objects)
    if (label != 0 && label < pixels.size()) ++pixels[label];
  if (k > result.sois.size())
    return fail(Error::Kind::invalid_option, fmt::format("object is {}, must be in 1..{} in this frame", k, result.sois.size()));
  if (k == 0) k = static_cast<std::size_t>(std::max_element(pixels.begin(), pixels.end()) - pixels.begin());
  if (pixels[k] == 0) return fail(Error::Kind::bad_input, "no object stands out in this frame: nothing to learn from");
  const cv::Mat1w labels(frame.height, frame.width, const_cast<std::uint16_t*>(result.objects.data()));  // only read
  return cv::Mat1b(labels == static_cast<double>(k));
}

}  // namespace

Expected<LearntView> learn_image(const fs::path& gallery, const std::string& name, const fs::path& image) {
  return io::guarded(image, Error::Kind::bad_input, [&]() -> Expected<LearntView> {
    if (!perception::is_image(image)) return fail(Error::Kind::bad_input, image.string() + ": is no image by its ending");
    const auto bytes = perception::read_picture(image);
    if (!bytes) return tl::unexpected(bytes.error());
    return add_view(gallery, name, *bytes, image.extension().string(), image.string());
  });
}

Expected<LearntView> learn_object(const fs::path& gallery, const std::string& name, const Cloud& frame, const PerceiveResult& result,
                                  std::size_t object) try {
  if (auto ok = frame.validate(); !ok) return tl::unexpected(ok.error());
  const auto mask = object_mask(frame, result, object);
  if (!mask) return tl::unexpected(mask.error());
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));  // only read
  cv::Rect box = cv::boundingRect(*mask);
  const cv::Point border(perception::kBorder, perception::kBorder);
  box = cv::Rect(box.tl() - border, box.br() + border) & cv::Rect({}, mask->size());
  cv::Mat picture;
  cv::merge(std::vector<cv::Mat>{rgb(box), (*mask)(box)}, picture);
  return add_view(gallery, name, io::encode_png(picture), ".png", fmt::format("object {}", object));
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input, [&] { return fmt::format("no memory for object {}", object); });
}

}  // namespace swarmfit
