// The pictures of a gallery's folder, and how closely they are looked at.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

#include "host/perception/gallery_index.hpp"
#include "host/perception/recognition_match.hpp"

namespace swarmfit::perception {

/// Matches that must agree on one placement. Fewer came together by chance on wood grain and print that is in no gallery.
inline constexpr std::size_t kLeastInliers = 6;
inline constexpr int kBorder = 12;  // [px] around a proto-object: SIFT's support beyond its outline

struct GalleryPicture {
  std::string name;
  std::filesystem::path file;
};

bool is_image(const std::filesystem::path& file);

/// One image, or a folder of images, a name; in order of their names. Fails with bad_input.
Expected<std::vector<GalleryPicture>> list_pictures(const std::filesystem::path& folder);

Expected<std::string> read_picture(const std::filesystem::path& file);
/// Of a picture's bytes. Where it has transparency, only what is opaque belongs to the object. `file` is for messages.
Expected<Features> picture_features(const std::filesystem::path& file, std::string_view bytes);
/// From the index, or found and put there.
Expected<Features> features_of(const std::filesystem::path& file, GalleryIndex& index);

/// What is small in the image is looked at through a lens of two.
void look_closer(cv::Mat1b& grey, cv::Mat1b& mask);

}  // namespace swarmfit::perception
