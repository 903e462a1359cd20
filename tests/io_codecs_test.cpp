// Images as another library's decoders see them: the same pixels from every kind of file, and ours in files that they can read.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <spng.h>
#include <turbojpeg.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/io/image.hpp"
#include "host/io/jpeg.hpp"
#include "host/io/png.hpp"

namespace swarmfit {
namespace {

std::string text(const std::vector<unsigned char>& bytes) { return {bytes.begin(), bytes.end()}; }
std::vector<unsigned char> raw(const std::string& bytes) { return {bytes.begin(), bytes.end()}; }

std::string written(const std::string& ending, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  std::vector<unsigned char> bytes;
  cv::imencode(ending, image, bytes, parameters);
  return text(bytes);
}

/// Smooth in places, noise in others.
cv::Mat picture(int width, int height, int type) {
  cv::Mat image(height, width, type);
  cv::theRNG().state = 7;
  const double most = image.depth() == CV_16U ? 65535 : 255;
  cv::randu(image, cv::Scalar::all(0), cv::Scalar::all(most));
  cv::Mat top = image.rowRange(0, height / 2);
  cv::GaussianBlur(top, top, {9, 9}, 3);
  return image;
}

struct Kind {
  int colours, bits;
  bool transparent, interlaced;
};

/// A PNG of any kind, its samples at random.
std::string png_of(const Kind& kind, std::uint32_t width, std::uint32_t height) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  spng_ihdr header{};
  header.width = width;
  header.height = height;
  header.bit_depth = static_cast<std::uint8_t>(kind.bits);
  header.color_type = static_cast<std::uint8_t>(kind.colours);
  header.interlace_method = kind.interlaced;
  spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1);
  EXPECT_EQ(spng_set_ihdr(context.get(), &header), 0);
  std::mt19937 random(3);
  if (kind.colours == SPNG_COLOR_TYPE_INDEXED) {
    spng_plte palette{};
    palette.n_entries = 1U << kind.bits;
    for (auto& entry : palette.entries) {
      entry.red = static_cast<std::uint8_t>(random());
      entry.green = static_cast<std::uint8_t>(random());
      entry.blue = static_cast<std::uint8_t>(random());
    }
    EXPECT_EQ(spng_set_plte(context.get(), &palette), 0);
  }
  if (kind.transparent) {
    spng_trns transparency{};
    transparency.n_type3_entries = 2;
    transparency.type3_alpha[0] = 9;
    transparency.type3_alpha[1] = 200;
    transparency.gray = transparency.red = transparency.green = transparency.blue = 1;
    EXPECT_EQ(spng_set_trns(context.get(), &transparency), 0);
  }
  const std::uint32_t channels[] = {1, 0, 3, 1, 2, 0, 4};
  std::string samples((width * channels[kind.colours] * header.bit_depth + 7) / 8 * height, '\0');
  for (char& byte : samples) byte = static_cast<char>(random());
  const int flags = SPNG_ENCODE_FINALIZE;
  EXPECT_EQ(spng_encode_image(context.get(), samples.data(), samples.size(), SPNG_FMT_PNG, flags), 0);
  std::size_t size = 0;
  int error = 0;
  const std::unique_ptr<void, decltype(&std::free)> bytes(spng_get_png_buffer(context.get(), &size, &error), &std::free);
  return {static_cast<const char*>(bytes.get()), size};
}

/// As another decoder sees it, in the library's order of colours.
cv::Mat seen(const std::string& bytes, int flags = cv::IMREAD_COLOR) {
  cv::Mat image = cv::imdecode(raw(bytes), flags);
  if (image.channels() == 3) cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2RGBA);
  return image;
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() ? cv::norm(a, b, cv::NORM_INF) : 1e9;
}

TEST(Codecs, EveryKindOfPngHasThePixelsThatOthersSee) {
  std::vector<Kind> kinds;
  for (const bool interlaced : {false, true}) {
    for (const int bits : {1, 2, 4, 8, 16}) {
      for (const bool transparent : {false, true}) {
        kinds.push_back({SPNG_COLOR_TYPE_GRAYSCALE, bits, transparent, interlaced});
        if (bits < 16) kinds.push_back({SPNG_COLOR_TYPE_INDEXED, bits, transparent, interlaced});
        if (bits >= 8) kinds.push_back({SPNG_COLOR_TYPE_TRUECOLOR, bits, transparent, interlaced});
      }
      if (bits >= 8) kinds.push_back({SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, bits, false, interlaced});
      if (bits >= 8) kinds.push_back({SPNG_COLOR_TYPE_TRUECOLOR_ALPHA, bits, false, interlaced});
    }
  }
  for (const Kind& kind : kinds) {
    const std::string bytes = png_of(kind, 37, 23);
    const std::string which = "colours " + std::to_string(kind.colours) + ", " + std::to_string(kind.bits) + " bits" +
                              (kind.transparent ? ", transparent" : "") + (kind.interlaced ? ", interlaced" : "");
    const auto ours = io::decode_image("a.png", bytes, false);
    ASSERT_TRUE(ours) << which << ": " << ours.error().message;
    EXPECT_EQ(largest_difference(*ours, seen(bytes)), 0) << which;

    const auto four = io::decode_image("a.png", bytes, true);
    ASSERT_TRUE(four) << which << ": " << four.error().message;
    cv::Mat stored = seen(bytes, cv::IMREAD_UNCHANGED);
    if (stored.depth() == CV_16U) stored.convertTo(stored, CV_8U, 1.0 / 256, -0.499);
    if (stored.channels() == 4) {
      EXPECT_EQ(largest_difference(*four, stored), 0) << which;
    }
    const auto depth = io::decode_png_depth("a.png", bytes);
    EXPECT_EQ(depth.has_value(), kind.bits == 16 && kind.colours == SPNG_COLOR_TYPE_GRAYSCALE) << which;
    if (depth) {
      EXPECT_EQ(largest_difference(*depth, seen(bytes, cv::IMREAD_UNCHANGED)), 0) << which;
    }
  }
}

TEST(Codecs, EveryKindOfJpegHasThePixelsThatOthersSee) {
  const cv::Mat colours = picture(61, 45, CV_8UC3), grey = picture(61, 45, CV_8UC1);
  for (const std::string& bytes :
       {written(".jpg", colours), written(".jpg", colours, {cv::IMWRITE_JPEG_QUALITY, 30}), written(".jpg", grey),
        written(".jpg", colours, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}), written(".jpg", colours, {cv::IMWRITE_JPEG_RST_INTERVAL, 2})}) {
    const auto ours = io::decode_image("a.jpg", bytes, true);
    ASSERT_TRUE(ours) << ours.error().message;
    EXPECT_EQ(largest_difference(*ours, seen(bytes)), 0);
  }
}

TEST(Codecs, InkAsJpegBecomesLight) {
  const cv::Mat ink = picture(40, 30, CV_8UC4);
  for (const int sampling : {TJSAMP_444, TJSAMP_420}) {
    const tjhandle encoder = tjInitCompress();
    unsigned char* out = nullptr;
    unsigned long size = 0;
    ASSERT_EQ(tjCompress2(encoder, ink.data, 40, 0, 30, TJPF_CMYK, &out, &size, sampling, 90, 0), 0);
    const std::string bytes(reinterpret_cast<char*>(out), size);
    tjFree(out);
    tjDestroy(encoder);
    const auto ours = io::decode_image("a.jpg", bytes, false);
    ASSERT_TRUE(ours) << ours.error().message;
    EXPECT_EQ(largest_difference(*ours, seen(bytes)), 0) << sampling;
  }
}

TEST(Codecs, ASampleOfChromaThatTurboJpegHasNoNameForIsReadAll) {
  std::string bytes = written(".jpg", picture(64, 64, CV_8UC3));
  const std::size_t frame = bytes.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  bytes[frame + 11] = '\x14';  // luma 1 x 4: as many blocks in a step as 2 x 2
  const auto ours = io::decode_image("a.jpg", bytes, false);
  ASSERT_TRUE(ours) << ours.error().message;
  EXPECT_EQ(largest_difference(*ours, seen(bytes)), 0);
}

TEST(Codecs, Netpbm) {
  for (const int type : {CV_8UC3, CV_8UC1, CV_16UC3, CV_16UC1}) {
    const cv::Mat image = picture(13, 9, type);
    const std::string bytes = written(image.channels() == 3 ? ".ppm" : ".pgm", image);
    const auto ours = io::decode_image("a.ppm", bytes, true);
    ASSERT_TRUE(ours) << ours.error().message;
    EXPECT_LE(largest_difference(*ours, seen(bytes)), image.depth() == CV_16U ? 1 : 0) << type;
    for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(io::decode_image("a.ppm", bytes.substr(0, size), true)) << size;
  }
  const auto grey = io::decode_image("a.pgm", std::string("P5 # as some write it\n2\t1 15\n") + '\x03' + '\x0f', false);
  ASSERT_TRUE(grey) << grey.error().message;
  EXPECT_EQ(grey->at<cv::Vec3b>(0, 0), cv::Vec3b(51, 51, 51));
  EXPECT_EQ(grey->at<cv::Vec3b>(0, 1), cv::Vec3b(255, 255, 255));
  for (const char* header : {"P5 -1 1 255\n ", "P5 99999 99999 255\n ", "P5 1 1 0\n ", "P5 1 1 65536\n  ", "P5 1 x 255\n ", "P5 1 #"}) {
    EXPECT_FALSE(io::decode_image("a.pgm", header, false)) << header;
  }
}

TEST(Codecs, OthersReadWhatIsWritten) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1}) {
    const cv::Mat image = picture(57, 31, type), part = image.colRange(5, 40);
    for (const io::PngEffort effort : {io::PngEffort::quick, io::PngEffort::small}) {
      EXPECT_EQ(largest_difference(seen(io::encode_png(image, effort), cv::IMREAD_UNCHANGED), image), 0) << type;
      EXPECT_EQ(largest_difference(seen(io::encode_png(part, effort), cv::IMREAD_UNCHANGED), part), 0) << type;
    }
  }
  const cv::Mat image = picture(57, 31, CV_8UC3);
  cv::Mat bgr;
  cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
  for (const int quality : {50, 80, 88, 95}) {
    EXPECT_EQ(io::encode_jpeg(image, quality), written(".jpg", bgr, {cv::IMWRITE_JPEG_QUALITY, quality})) << quality;
  }
  EXPECT_ANY_THROW(io::encode_png({}));
  EXPECT_ANY_THROW(io::encode_jpeg({}, 80));
}

TEST(Codecs, WhatIsCutShortOrDamagedIsAnErrorAndNothingIsPrinted) {
  const cv::Mat colours = picture(160, 120, CV_8UC3), depth = picture(160, 120, CV_16UC1);
  const std::vector<std::string> files = {written(".png", colours),
                                          written(".png", depth),
                                          png_of({SPNG_COLOR_TYPE_INDEXED, 4, true, true}, 90, 70),
                                          written(".jpg", colours),
                                          written(".jpg", colours, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
                                          written(".ppm", colours)};
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  std::size_t decoded = 0;
  for (const std::string& whole : files) {
    EXPECT_TRUE(io::decode_image("whole", whole, true));
    for (std::size_t size = 0; size < whole.size(); size += 97) {
      const auto cut = io::decode_image("cut", whole.substr(0, size), true);
      ASSERT_FALSE(cut) << size << " of " << whole.size();
      EXPECT_EQ(cut.error().kind, Error::Kind::bad_input);
      EXPECT_EQ(cut.error().message.find('\n'), std::string::npos);
    }
    std::mt19937 random(5);
    for (std::size_t flips = 1; flips <= 300; ++flips) {
      std::string damaged = whole;
      for (std::size_t k = 0; k <= flips / 100; ++k) {
        damaged[random() % (flips % 2 ? damaged.size() : 200)] ^= static_cast<char>(1U << random() % 8);
      }
      const bool png = io::is_png(whole);
      const auto result = io::decode_image("damaged", damaged, true);
      if (png && damaged != whole) {
        EXPECT_FALSE(result) << flips;
      }
      decoded += result.has_value();
      if (png) io::decode_png_depth("damaged", damaged);
    }
  }
  EXPECT_GT(decoded, 0U);  // a JPEG has no checksums, and some of its bits are as good turned round
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(Codecs, AHeaderOfMorePixelsThanItsBytesHoldAsksForNoMemory) {
  std::string jpeg = written(".jpg", picture(16, 16, CV_8UC3));
  const std::size_t frame = jpeg.find("\xff\xc0");
  jpeg.replace(frame + 5, 4, "\x7f\xff\x7f\xff");
  const auto wide = io::decode_image("a.jpg", jpeg, false);
  ASSERT_FALSE(wide);
  EXPECT_NE(wide.error().message.find("32767 x 32767 pixels, which its"), std::string::npos) << wide.error().message;
  const auto bomb = io::decode_image(
      "a.png", png_of({SPNG_COLOR_TYPE_GRAYSCALE, 1, false, false}, 9, 9).replace(16, 8, "\x7f\xff\xff\xff\x7f\xff\xff\xff"), false);
  EXPECT_FALSE(bomb);
  const auto other = io::decode_image("a.webp", "RIFF\x10", false);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().message, "a.webp: is not an image in PNG, JPEG or binary Netpbm (P5, P6)");
}

}  // namespace
}  // namespace swarmfit
