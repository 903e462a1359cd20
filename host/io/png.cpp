#include "host/io/png.hpp"

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <stdexcept>

#include <spng.h>

#include "host/io/file.hpp"
#include "host/io/image.hpp"

namespace swarmfit::io {
namespace {

using Context = std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)>;

constexpr std::size_t kMostChunk = std::size_t{64} << 20;  ///< bytes of one chunk beside the pixels, unpacked, and of all of them
// zlib's strategies
constexpr int kHuffmanOnly = 2, kRunLengths = 3;

tl::unexpected<Error> faulty(const std::filesystem::path& file, int error) {
  if (error == SPNG_EMEM) return fail(Error::Kind::out_of_memory, file.string() + ": does not fit in memory");
  const bool cut = error == SPNG_IO_EOF || error == SPNG_EIDAT_TOO_SHORT;
  return bad_input(file, "PNG is {}: {}", cut ? "cut short" : "damaged", spng_strerror(error));
}

/// One file's decoder; what it says is asked for in turn.
class Decoder {
 public:
  Decoder(const std::filesystem::path& file, std::string_view bytes)
      : file_(file), bytes_(bytes), context_(spng_ctx_new(0), spng_ctx_free) {
    if (!context_) throw std::bad_alloc();
  }

  Expected<spng_ihdr> header() {
    spng_ihdr header{};
    int error = spng_set_crc_action(context_.get(), SPNG_CRC_ERROR, SPNG_CRC_ERROR);
    if (!error) error = spng_set_chunk_limits(context_.get(), kMostChunk, kMostChunk);
    if (!error) error = spng_set_png_buffer(context_.get(), bytes_.data(), bytes_.size());
    if (!error) error = spng_get_ihdr(context_.get(), &header);
    if (error) return faulty(file_, error);
    // Deflate packs at most 1032 to 1, and a pixel takes at least a bit.
    if (auto ok = check_pixels(file_, "PNG", header.width, header.height, 8 * 1032, bytes_.size()); !ok) return tl::unexpected(ok.error());
    return header;
  }

  bool transparent(const spng_ihdr& header) {
    spng_trns colours{};
    return header.color_type == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA || header.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA ||
           spng_get_trns(context_.get(), &colours) == 0;
  }

  /// Reads on to the file's end: what follows the pixels must be whole, too.
  Expected<cv::Mat> pixels(const spng_ihdr& header, int type, int format, int flags) {
    cv::Mat image(static_cast<int>(header.height), static_cast<int>(header.width), type);
    int error = spng_decode_image(context_.get(), image.data, image.total() * image.elemSize(), format, flags);
    if (!error) error = spng_decode_chunks(context_.get());
    if (error) return faulty(file_, error);
    return image;
  }

 private:
  const std::filesystem::path& file_;
  std::string_view bytes_;
  Context context_;
};

}  // namespace

bool is_png(std::string_view bytes) { return bytes.starts_with(std::string_view("\x89PNG\r\n\x1a\n", 8)); }

Expected<cv::Mat> decode_png(const std::filesystem::path& file, std::string_view bytes, bool alpha) {
  Decoder decoder(file, bytes);
  const auto header = decoder.header();
  if (!header) return tl::unexpected(header.error());
  const bool four = alpha && decoder.transparent(*header);
  const int colours = four ? SPNG_COLOR_TYPE_TRUECOLOR_ALPHA : SPNG_COLOR_TYPE_TRUECOLOR;
  const bool stored_so = header->bit_depth == 8 && header->color_type == colours;  // and then taken faster
  const int format = stored_so ? SPNG_FMT_PNG : four ? SPNG_FMT_RGBA8 : SPNG_FMT_RGB8;
  return decoder.pixels(*header, four ? CV_8UC4 : CV_8UC3, format, four ? SPNG_DECODE_TRNS : 0);
}

Expected<cv::Mat> decode_png_depth(const std::filesystem::path& file, std::string_view bytes) {
  Decoder decoder(file, bytes);
  const auto header = decoder.header();
  if (!header) return tl::unexpected(header.error());
  if (header->bit_depth != 16 || header->color_type != SPNG_COLOR_TYPE_GRAYSCALE) {
    const int channels[] = {1, 0, 3, 3, 2, 0, 4};  // by colour type; a palette is of three
    return bad_input(file, "is an image of {} bits and {} channels, a depth image must have 16 bits and 1 channel", header->bit_depth,
                     channels[header->color_type]);
  }
  return decoder.pixels(*header, CV_16UC1, SPNG_FMT_PNG, 0);
}

std::string encode_png(const cv::Mat& image, PngEffort effort) {
  if (image.empty()) throw std::invalid_argument("an image of no pixels has no PNG");
  const cv::Mat pixels = image.isContinuous() ? image : image.clone();
  const Context context(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  if (!context) throw std::bad_alloc();
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(image.cols);
  header.height = static_cast<std::uint32_t>(image.rows);
  header.bit_depth = static_cast<std::uint8_t>(8 * image.elemSize1());
  header.color_type = image.channels() == 1   ? SPNG_COLOR_TYPE_GRAYSCALE
                      : image.channels() == 3 ? SPNG_COLOR_TYPE_TRUECOLOR
                                              : SPNG_COLOR_TYPE_TRUECOLOR_ALPHA;
  int error = spng_set_ihdr(context.get(), &header);
  const auto set = [&](spng_option option, int value) {
    if (!error) error = spng_set_option(context.get(), option, value);
  };
  set(SPNG_ENCODE_TO_BUFFER, 1);
  if (effort == PngEffort::small) {
    set(SPNG_IMG_COMPRESSION_LEVEL, 9);
  } else {  // labels are runs of one value; in pictures a search for what came before takes time and finds little
    set(SPNG_IMG_COMPRESSION_LEVEL, 1);
    set(SPNG_IMG_COMPRESSION_STRATEGY, image.channels() == 1 ? kRunLengths : kHuffmanOnly);
    set(SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
  }
  if (!error) error = spng_encode_image(context.get(), pixels.data, pixels.total() * pixels.elemSize(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
  std::size_t size = 0;
  const std::unique_ptr<void, decltype(&std::free)> bytes(error ? nullptr : spng_get_png_buffer(context.get(), &size, &error), &std::free);
  if (error == SPNG_EMEM) throw std::bad_alloc();
  if (error) throw std::runtime_error(std::string("PNG cannot be encoded: ") + spng_strerror(error));
  return {static_cast<const char*>(bytes.get()), size};
}

}  // namespace swarmfit::io
