// Images from files, PNG and JPEG, checked before they are decoded.
#pragma once

#include <filesystem>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

namespace swarmfit::io {

/// 8-bit blue, green, red, whatever the file's own depth and channels.
Expected<cv::Mat> read_colour_image(const std::filesystem::path& file);
/// 16-bit, one channel, PNG.
Expected<cv::Mat> read_depth_image(const std::filesystem::path& file);

}  // namespace swarmfit::io
