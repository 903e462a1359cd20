#include "host/io/netpbm.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "host/io/file.hpp"
#include "host/io/image.hpp"

namespace swarmfit::io {
namespace {

constexpr std::string_view kBlank = " \t\r\n\v\f";

/// Takes a header's number, and blanks and comments before it, off `rest`.
bool take_number(std::string_view& rest, std::uint32_t& number) {
  while (!rest.empty() && (rest.front() == '#' || kBlank.find(rest.front()) != std::string_view::npos)) {
    const std::size_t end = rest.front() == '#' ? rest.find('\n') : 0;
    if (end == std::string_view::npos) return false;
    rest.remove_prefix(end + 1);
  }
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc{}) return false;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return true;
}

}  // namespace

bool is_netpbm(std::string_view bytes) {
  return bytes.size() > 2 && (bytes.starts_with("P5") || bytes.starts_with("P6")) && kBlank.find(bytes[2]) != std::string_view::npos;
}

Expected<cv::Mat> decode_netpbm(const std::filesystem::path& file, std::string_view bytes) {
  std::string_view rest = bytes.substr(2);
  std::array<std::uint32_t, 3> numbers{};
  for (std::uint32_t& number : numbers) {
    if (!take_number(rest, number)) return bad_input(file, "Netpbm header must hold width, height and largest value");
  }
  const auto [width, height, most] = numbers;
  if (most < 1 || most > 65535) return bad_input(file, "Netpbm header: largest value {}, must be in 1..65535", most);
  if (rest.empty() || kBlank.find(rest.front()) == std::string_view::npos) return bad_input(file, "Netpbm header must end with a blank");
  rest.remove_prefix(1);
  const std::size_t channels = bytes[1] == '6' ? 3 : 1, wide = most > 255 ? 2 : 1;
  if (auto ok = check_pixels(file, "Netpbm", width, height, 1, bytes.size()); !ok) return tl::unexpected(ok.error());
  const std::size_t needed = std::size_t{width} * height * channels * wide;
  if (rest.size() < needed)
    return bad_input(file, "Netpbm image is cut short: {} bytes of pixels, but only {} follow", needed, rest.size());
  cv::Mat image(static_cast<int>(height), static_cast<int>(width), CV_8UC3);
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(rest[i])); };
  for (std::size_t pixel = 0; pixel < image.total(); ++pixel) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = (pixel * channels + (channels == 3 ? c : 0)) * wide;
      const std::uint32_t value = std::min(wide == 2 ? byte(at) << 8 | byte(at + 1) : byte(at), most);
      image.data[3 * pixel + c] = static_cast<std::uint8_t>(value * 255 / most);
    }
  }
  return image;
}

}  // namespace swarmfit::io
