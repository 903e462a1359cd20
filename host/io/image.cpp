#include "host/io/image.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include <opencv2/imgcodecs.hpp>

#include "host/io/file.hpp"

namespace swarmfit::io {
namespace {

constexpr std::string_view kPng("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kJpeg("\xff\xd8\xff", 3);
/// Pixels an image may have; a larger one is taken for a damaged header.
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]);
  return value;
}

/// CRC-32 as PNG has it, eight bytes a step.
class Crc32 {
 public:
  Crc32() {
    for (std::uint32_t n = 0; n < 256; ++n) {
      std::uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320U ^ (c >> 1) : c >> 1;
      table_[0][n] = c;
    }
    for (std::size_t t = 1; t < 8; ++t) {
      for (std::size_t n = 0; n < 256; ++n) table_[t][n] = table_[0][table_[t - 1][n] & 0xff] ^ (table_[t - 1][n] >> 8);
    }
  }
  std::uint32_t operator()(std::string_view bytes) const noexcept {
    std::uint32_t c = 0xffffffffU;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    for (; bytes.size() >= 8; bytes.remove_prefix(8)) {
      const std::uint32_t low = c ^ (byte(0) | byte(1) << 8 | byte(2) << 16 | static_cast<std::uint32_t>(byte(3)) << 24);
      c = table_[7][low & 0xff] ^ table_[6][low >> 8 & 0xff] ^ table_[5][low >> 16 & 0xff] ^ table_[4][low >> 24] ^ table_[3][byte(4)] ^
          table_[2][byte(5)] ^ table_[1][byte(6)] ^ table_[0][byte(7)];
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) c = table_[0][(c ^ byte(i)) & 0xff] ^ (c >> 8);
    return ~c;
  }

 private:
  std::array<std::array<std::uint32_t, 256>, 8> table_{};
};

/// The size in IHDR, once every chunk up to IEND is known to be whole. The decoder below would print what it meets; we answer instead.
Expected<cv::Size> check_png(const std::filesystem::path& file, std::string_view bytes) {
  static const Crc32 crc;
  std::optional<cv::Size> size;
  std::string_view rest = bytes.substr(kPng.size());
  while (true) {
    if (rest.size() < 12) return bad_input(file, "PNG ends before its last chunk");
    const std::uint32_t length = big_endian(rest);
    const std::string_view name = rest.substr(4, 4);
    if (length > rest.size() - 12)
      return bad_input(file, "PNG is cut short: chunk {} has {} bytes, but only {} follow", excerpt(name), length, rest.size() - 12);
    if (crc(rest.substr(4, length + 4)) != big_endian(rest.substr(8 + length)))
      return bad_input(file, "PNG is damaged: checksum of chunk {}", excerpt(name));
    if (!size) {
      if (name != "IHDR" || length != 13) return bad_input(file, "PNG does not start with IHDR");
      const std::uint64_t width = big_endian(rest.substr(8)), height = big_endian(rest.substr(12));
      // Deflate packs at most 1032 to 1, and a pixel takes at least a bit.
      if (width < 1 || height < 1 || width * height > kMostPixels || width * height / 8 > bytes.size() * std::uint64_t{1032}) {
        return bad_input(file, "PNG says it is {} x {} pixels, which its {} bytes cannot hold", width, height, bytes.size());
      }
      size = cv::Size(static_cast<int>(width), static_cast<int>(height));
    }
    if (name == "IEND") return *size;
    rest.remove_prefix(12 + length);
  }
}

Expected<cv::Mat> decode(const std::filesystem::path& file, int flags, bool jpeg_too) {
  const auto bytes = read_file(file);
  if (!bytes) return tl::unexpected(bytes.error());
  const std::string_view text = bytes->text();
  if (text.starts_with(kPng)) {
    if (auto size = check_png(file, text); !size) return tl::unexpected(size.error());
  } else if (jpeg_too && text.starts_with(kJpeg)) {
    if (text.find("\xff\xd9", text.size() > 4096 ? text.size() - 4096 : 0) == std::string_view::npos)
      return bad_input(file, "JPEG is cut short");
  } else {
    return bad_input(file, "is not a {} image", jpeg_too ? "PNG or JPEG" : "PNG");
  }
  if (bytes->size() > std::size_t{std::numeric_limits<int>::max()})
    return bad_input(file, "has {} bytes, too many for an image", bytes->size());
  const cv::Mat encoded(1, static_cast<int>(bytes->size()), CV_8U, const_cast<char*>(bytes->data()));
  cv::Mat image = cv::imdecode(encoded, flags);
  if (image.empty()) return bad_input(file, "cannot be decoded as an image");
  return image;
}

}  // namespace

Expected<cv::Mat> read_colour_image(const std::filesystem::path& file) {
  return decode(file, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION, true);
}

Expected<cv::Mat> read_depth_image(const std::filesystem::path& file) {
  auto image = decode(file, cv::IMREAD_UNCHANGED, false);
  if (image && image->type() != CV_16UC1) {
    return bad_input(file, "is an image of {} bits and {} channels, a depth image must have 16 bits and 1 channel", 8 * image->elemSize1(),
                     image->channels());
  }
  return image;
}

}  // namespace swarmfit::io
