// Images from files: PNG, JPEG and binary Netpbm, by what a file holds and not by its name. Nothing is ever printed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include <opencv2/core.hpp>

#include <swarmfit/error.hpp>

namespace swarmfit::io {

/// 8-bit RGB, whatever the file's own depth and channels.
Expected<cv::Mat> read_colour_image(const std::filesystem::path& file);
/// 16-bit, one channel, PNG.
Expected<cv::Mat> read_depth_image(const std::filesystem::path& file);
/// Of a file's bytes: 8-bit RGB, or RGBA where the file has it and `alpha` is set. `file` is for messages.
Expected<cv::Mat> decode_image(const std::filesystem::path& file, std::string_view bytes, bool alpha);

/// For the decoders, before they ask for memory: no format packs more than `pixels_a_byte`; a header that says so is damaged.
Expected<> check_pixels(const std::filesystem::path& file, const char* format, std::uint32_t width, std::uint32_t height,
                        std::uint64_t pixels_a_byte, std::size_t bytes);

}  // namespace swarmfit::io
