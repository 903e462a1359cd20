// JPEG from and to memory, through TurboJPEG.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

namespace swarmfit::io {

bool is_jpeg(std::string_view bytes);

/// 8-bit RGB, from grey, YCbCr, RGB, CMYK and YCCK; as stored, whatever Exif says of the camera's orientation. `file` is for messages.
/// Fails with bad_input: cut short, damaged, of more pixels than its bytes can hold.
Expected<cv::Mat> decode_jpeg(const std::filesystem::path& file, std::string_view bytes);

/// Of 8-bit RGB; `quality` from 1 to 100, chroma at half the resolution. Throws std::bad_alloc, std::runtime_error.
std::string encode_jpeg(const cv::Mat& image, int quality);

}  // namespace swarmfit::io
