// PNG from and to memory, through libspng.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

namespace swarmfit::io {

bool is_png(std::string_view bytes);

/// 8-bit RGB, or RGBA where `alpha` is wanted and the file has any; 16 bits a channel lose the lower 8. `file` is for messages.
/// Fails with bad_input: cut short, damaged (every checksum is looked at), of more pixels than its bytes can hold.
Expected<cv::Mat> decode_png(const std::filesystem::path& file, std::string_view bytes, bool alpha);

/// As stored, CV_16UC1. Fails with bad_input, as above, and where the image is not of 16 bits and one channel.
Expected<cv::Mat> decode_png_depth(const std::filesystem::path& file, std::string_view bytes);

enum class PngEffort { quick, small };

/// Of 8 or 16 bits; 1, 3 (RGB) or 4 (RGBA) channels. Throws std::bad_alloc, std::invalid_argument (no pixels).
std::string encode_png(const cv::Mat& image, PngEffort effort = PngEffort::quick);

}  // namespace swarmfit::io
