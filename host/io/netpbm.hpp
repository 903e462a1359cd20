// Binary Netpbm images, grey (P5) and coloured (P6), from memory.
#pragma once

#include <filesystem>
#include <string_view>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

namespace swarmfit::io {

bool is_netpbm(std::string_view bytes);

/// 8-bit RGB, from samples of 8 or 16 bits. `file` is for messages. Fails with bad_input: cut short, damaged.
Expected<cv::Mat> decode_netpbm(const std::filesystem::path& file, std::string_view bytes);

}  // namespace swarmfit::io
