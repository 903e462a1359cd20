#include "host/io/image.hpp"

#include "host/io/file.hpp"
#include "host/io/jpeg.hpp"
#include "host/io/netpbm.hpp"
#include "host/io/png.hpp"

namespace swarmfit::io {
namespace {

/// Pixels an image may have; a larger one is taken for a damaged header.
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;

}  // namespace

Expected<> check_pixels(const std::filesystem::path& file, const char* format, std::uint32_t width, std::uint32_t height,
                        std::uint64_t pixels_a_byte, std::size_t bytes) {
  const std::uint64_t pixels = std::uint64_t{width} * height;
  if (pixels >= 1 && pixels <= kMostPixels && pixels <= pixels_a_byte * bytes) return {};
  return bad_input(file, "{} says it is {} x {} pixels, which its {} bytes cannot hold", format, width, height, bytes);
}

Expected<cv::Mat> decode_image(const std::filesystem::path& file, std::string_view bytes, bool alpha) {
  return guarded(file, Error::Kind::bad_input, [&]() -> Expected<cv::Mat> {
    if (is_png(bytes)) return decode_png(file, bytes, alpha);
    if (is_jpeg(bytes)) return decode_jpeg(file, bytes);
    if (is_netpbm(bytes)) return decode_netpbm(file, bytes);
    return bad_input(file, "is not an image in PNG, JPEG or binary Netpbm (P5, P6)");
  });
}

Expected<cv::Mat> read_colour_image(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(file, bytes->text(), false);
}

Expected<cv::Mat> read_depth_image(const std::filesystem::path& file) {
  const auto bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  if (!is_png(bytes->text())) return bad_input(file, "is not a PNG image");
  return guarded(file, Error::Kind::bad_input, [&] { return decode_png_depth(file, bytes->text()); });
}

}  // namespace swarmfit::io
