#include "host/io/jpeg.hpp"

#include <cstdint>
#include <memory>
#include <new>
#include <stdexcept>
#include <type_traits>

#include <turbojpeg.h>

#include "host/io/file.hpp"
#include "host/io/image.hpp"

namespace swarmfit::io {
namespace {

struct Destroy {
  void operator()(tjhandle handle) const noexcept { tjDestroy(handle); }
};
using Handle = std::unique_ptr<std::remove_pointer_t<tjhandle>, Destroy>;

const unsigned char* data(std::string_view bytes) { return reinterpret_cast<const unsigned char*>(bytes.data()); }

tl::unexpected<Error> faulty(const std::filesystem::path& file, const Handle& decoder) {
  return bad_input(file, "JPEG is cut short or damaged: {}", excerpt(tjGetErrorStr2(decoder.get())));
}

/// Ink as Adobe's programs write it: 255 is none.
cv::Mat without_ink(const cv::Mat& cmyk) {
  cv::Mat image(cmyk.size(), CV_8UC3);
  for (int v = 0; v < cmyk.rows; ++v) {
    const std::uint8_t* from = cmyk.ptr<std::uint8_t>(v);
    std::uint8_t* to = image.ptr<std::uint8_t>(v);
    for (int u = 0; u < cmyk.cols; ++u, from += 4, to += 3) {
      const int black = from[3];
      for (int c = 0; c < 3; ++c) to[c] = static_cast<std::uint8_t>(black - ((255 - from[c]) * black >> 8));
    }
  }
  return image;
}

}  // namespace

bool is_jpeg(std::string_view bytes) { return bytes.starts_with("\xff\xd8\xff"); }

Expected<cv::Mat> decode_jpeg(const std::filesystem::path& file, std::string_view bytes) {
  const Handle decoder(tjInitDecompress());
  if (!decoder) throw std::bad_alloc();
  int width = 0, height = 0, sampling = -1, colours = -1;
  // Fails for rare samplings of chroma, too, with all else known by then; decoding takes them.
  if (tjDecompressHeader3(decoder.get(), data(bytes), bytes.size(), &width, &height, &sampling, &colours) != 0 &&
      (width < 1 || height < 1 || colours < 0)) {
    return faulty(file, decoder);
  }
  // A block of 8 x 8 pixels takes at least a bit.
  if (auto ok = check_pixels(file, "JPEG", static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 512, bytes.size()); !ok) {
    return tl::unexpected(ok.error());
  }
  const bool ink = colours == TJCS_CMYK || colours == TJCS_YCCK;
  cv::Mat image(height, width, ink ? CV_8UC4 : CV_8UC3);
  // What it can go on from it calls a warning, but the pixels are then not those that were taken.
  if (tjDecompress2(decoder.get(), data(bytes), bytes.size(), image.data, width, 0, height, ink ? TJPF_CMYK : TJPF_RGB,
                    TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0) {
    return faulty(file, decoder);
  }
  return ink ? without_ink(image) : image;
}

std::string encode_jpeg(const cv::Mat& image, int quality) {
  const Handle encoder(tjInitCompress());
  if (!encoder) throw std::bad_alloc();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  const int failed = tjCompress2(encoder.get(), image.data, image.cols, static_cast<int>(image.step), image.rows, TJPF_RGB, &out, &size,
                                 TJSAMP_420, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> bytes(out, &tjFree);
  if (failed) throw std::runtime_error(std::string("JPEG cannot be encoded: ") + tjGetErrorStr2(encoder.get()));
  return {reinterpret_cast<const char*>(bytes.get()), size};
}

}  // namespace swarmfit::io
