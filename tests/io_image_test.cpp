#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <swarmfit/cloud.hpp>
#include <swarmfit/images.hpp>

#include "host/io/calib.hpp"
#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using tests::TemporaryFolder;

const Intrinsics kCamera{600, 610, 1.5, 1};

template <class T>
void expect_error(const Expected<T>& result, Error::Kind kind, const std::string& what) {
  ASSERT_FALSE(result) << what;
  EXPECT_EQ(result.error().kind, kind);
  EXPECT_NE(result.error().message.find(what), std::string::npos) << result.error().message;
  EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
}

/// A 4 x 3 depth image of 1000 + pixel number, with a hole at pixel 5.
std::filesystem::path depth_image(const TemporaryFolder& folder) {
  cv::Mat depth(3, 4, CV_16U);
  for (int i = 0; i < 12; ++i) depth.at<std::uint16_t>(i / 4, i % 4) = static_cast<std::uint16_t>(i == 5 ? 0 : 1000 + i);
  cv::imwrite((folder / "depth.png").string(), depth);
  return folder / "depth.png";
}

std::filesystem::path colour_image(const TemporaryFolder& folder, const std::string& name, int width, int height) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(3, 2, 1));
  cv::imwrite((folder / name).string(), image);
  return folder / name;
}

TEST(Depth, BackProjects) {
  const TemporaryFolder folder;
  const auto cloud = read_depth(depth_image(folder), kCamera, 0.001);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->width, 4);
  EXPECT_EQ(cloud->height, 3);
  ASSERT_TRUE(cloud->intrinsics);
  EXPECT_EQ(cloud->intrinsics->fy, 610);
  EXPECT_TRUE(std::isnan(cloud->values32[3 * 5]) && std::isnan(cloud->values32[3 * 5 + 2]));
  const float* p = &cloud->values32[3 * 11];  // (3, 2)
  EXPECT_FLOAT_EQ(p[2], 1.011F);
  EXPECT_FLOAT_EQ(p[0], 1.011F * 1.5F / 600);
  EXPECT_FLOAT_EQ(p[1], 1.011F / 610);
}

TEST(Depth, FromMemoryAsFromFiles) {
  const TemporaryFolder folder;
  const auto file = depth_image(folder);
  const auto colours = colour_image(folder, "c.png", 4, 3);
  const auto read = read_rgbd(colours, file, kCamera, 0.001);
  ASSERT_TRUE(read) << read.error().message;

  const cv::Mat depth = cv::imread(file.string(), cv::IMREAD_UNCHANGED), bgr = cv::imread(colours.string());
  cv::Mat wide(3, 7, CV_16U, cv::Scalar(9)), metres;  // rows further apart than they are long
  depth.copyTo(wide.colRange(0, 4));
  depth.convertTo(metres, CV_32F);
  const ColourView colour{bgr.data, ColourView::Order::bgr, 4, 3, 0};
  const auto whole = make_cloud({wide.data, DepthView::Scalar::uint16, 4, 3, wide.step}, kCamera, 0.001, colour);
  const auto real = make_cloud({metres.data, DepthView::Scalar::float32, 4, 3, 0}, kCamera, 0.001);
  ASSERT_TRUE(whole) << whole.error().message;
  ASSERT_TRUE(real) << real.error().message;
  EXPECT_EQ(whole->rgb, read->rgb);
  EXPECT_TRUE(real->rgb.empty());
  for (std::size_t i = 0; i < read->values32.size(); ++i) {
    if (std::isnan(read->values32[i])) {
      EXPECT_TRUE(std::isnan(whole->values32[i]) && std::isnan(real->values32[i]));
    } else {
      EXPECT_EQ(whole->values32[i], read->values32[i]);
      EXPECT_EQ(real->values32[i], read->values32[i]);
    }
  }

  const std::uint8_t rgb[] = {1, 2, 3, 4, 5, 6};
  const float z[] = {1, -1};
  const DepthView pair{z, DepthView::Scalar::float32, 2, 1, 0};
  const auto small = make_cloud(pair, kCamera, 1, {rgb, ColourView::Order::rgb, 2, 1, 0});
  ASSERT_TRUE(small);
  EXPECT_EQ(small->rgb, (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_TRUE(std::isnan(small->values32[5]));
  expect_error(make_cloud({}, kCamera, 1), Error::Kind::bad_input, "depth image is 0 x 0 pixels, must be >= 1 x 1");
  expect_error(make_cloud(pair, kCamera, 0), Error::Kind::invalid_option, "depth scale: 0, must be > 0");
  expect_error(make_cloud(pair, kCamera, 1, {rgb, ColourView::Order::rgb, 1, 2, 0}), Error::Kind::bad_input, "must be 2 x 1 as the depth");
  expect_error(make_cloud({z, DepthView::Scalar::float32, 2, 1, 4}, kCamera, 1), Error::Kind::invalid_option, "depth row_step: 4, must be");
}

TEST(Depth, ColoursInOrder) {
  const TemporaryFolder folder;
  const auto cloud = read_rgbd(colour_image(folder, "c.png", 4, 3), depth_image(folder), kCamera, 0.001);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->rgb.size(), 36U);
  EXPECT_EQ(cloud->rgb[33], 1);
  EXPECT_EQ(cloud->rgb[35], 3);
  EXPECT_TRUE(read_rgbd(colour_image(folder, "c.jpg", 4, 3), depth_image(folder), kCamera, 0.001));
}

TEST(Depth, Faults) {
  const TemporaryFolder folder;
  const auto depth = depth_image(folder);
  expect_error(read_rgbd(colour_image(folder, "c.png", 5, 3), depth, kCamera, 0.001), Error::Kind::bad_input,
               "5 x 3 pixels, must be 4 x 3");
  expect_error(read_depth(folder / "c.png", kCamera, 0.001), Error::Kind::bad_input, "8 bits and 3 channels");
  expect_error(read_depth(folder / "none.png", kCamera, 0.001), Error::Kind::bad_input, "none.png");
  expect_error(read_depth(folder.put("text.png", "hello"), kCamera, 0.001), Error::Kind::bad_input, "not a PNG");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double scale : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    expect_error(read_depth(depth, kCamera, scale), Error::Kind::invalid_option, "depth scale");
  }
  expect_error(read_depth(depth, {0, 1, 1, 1}, 0.001), Error::Kind::invalid_option, "fx: 0");
  expect_error(read_depth(depth, {1, nan, 1, 1}, 0.001), Error::Kind::invalid_option, "fy: nan");
  expect_error(read_depth(depth, {1, 1, nan, 1}, 0.001), Error::Kind::invalid_option, "cx: nan");
}

TEST(Depth, AnImageCutShortOrDamagedIsAnError) {
  const TemporaryFolder folder;
  const std::string whole = tests::contents(depth_image(folder));
  // The last four bytes are the checksum of an empty chunk.
  for (std::size_t size = 0; size < whole.size() - 4; ++size) {
    EXPECT_FALSE(read_depth(folder.put("cut.png", whole.substr(0, size)), kCamera, 0.001)) << size;
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    EXPECT_FALSE(read_depth(folder.put("damaged.png", damaged), kCamera, 0.001)) << i;
  }
  const std::string jpeg = tests::contents(colour_image(folder, "c.jpg", 40, 30));
  expect_error(read_rgbd(folder.put("cut.jpg", jpeg.substr(0, jpeg.size() / 2)), folder / "depth.png", kCamera, 0.001),
               Error::Kind::bad_input, "cut short");
}

const char* const kCalib =
    "cam0=[ 1038.018 0 322.037 ; 0 1038.018 243.393 ; 0 0 1 ] \ncam1=[1038.018 0 375.308; 0 1038.018 243.393; 0 0 1]\n doffs= 53.271 \n"
    "baseline= 176.252\r\n width= 718\nheight= 496\n ndisp= 73\n isint=0\n vmin= 8 \n";

TEST(Calibration, BlanksAnywhere) {
  const TemporaryFolder folder;
  const auto calib = io::read_calibration(folder.put("calib.txt", kCalib));
  ASSERT_TRUE(calib) << calib.error().message;
  EXPECT_EQ(calib->left.fx, 1038.018);
  EXPECT_EQ(calib->left.cy, 243.393);
  EXPECT_EQ(calib->doffs, 53.271);
  EXPECT_DOUBLE_EQ(calib->baseline, 0.176252);
  EXPECT_EQ(calib->disparities, 73);
  EXPECT_EQ(calib->width, 718);
}

TEST(Calibration, Faults) {
  const TemporaryFolder folder;
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = kCalib;
    text.replace(text.find(from), from.size(), to);
    return io::read_calibration(folder.put("calib.txt", text));
  };
  expect_error(changed("cam0", "camera"), Error::Kind::bad_input, "field cam0 is missing");
  expect_error(changed(" doffs= 53.271 \n", ""), Error::Kind::bad_input, "field doffs is missing");
  expect_error(changed("baseline= 176.252\r\n", ""), Error::Kind::bad_input, "field baseline is missing");
  expect_error(changed(" ndisp= 73\n", ""), Error::Kind::bad_input, "field ndisp is missing");
  expect_error(changed("ndisp= 73", "ndisp= 0"), Error::Kind::bad_input, "field ndisp: 0");
  expect_error(changed("ndisp= 73", "ndisp= 1e9"), Error::Kind::bad_input, "field ndisp: 1000000000");
  expect_error(changed("176.252", "-1"), Error::Kind::bad_input, "field baseline: -1");
  expect_error(changed("176.252", "far"), Error::Kind::bad_input, "'far'");
  expect_error(changed("[ 1038.018 0 322.037 ;", "["), Error::Kind::bad_input, "9 numbers");
  expect_error(changed("[ 1038.018", "[ 0"), Error::Kind::bad_input, "focal length 0");
  expect_error(changed("isint=0", "isint"), Error::Kind::bad_input, "key=value");
  expect_error(io::read_calibration(folder / "none.txt"), Error::Kind::bad_input, "none.txt");
}

TEST(Stereo, SizesMustAgree) {
  const TemporaryFolder folder;
  const auto left = colour_image(folder, "l.png", 80, 40), right = colour_image(folder, "r.png", 80, 41);
  const std::string calib = "cam0=[100 0 40; 0 100 20; 0 0 1]\ndoffs=0\nbaseline=100\nndisp=16\n";
  expect_error(read_stereo(left, right, folder.put("calib.txt", calib)), Error::Kind::bad_input, "80 x 41");
  expect_error(read_stereo(left, left, folder.put("calib.txt", calib + "width=79\n")), Error::Kind::bad_input, "79");
  expect_error(read_stereo(left, left, folder.put("calib.txt", "cam0=[100 0 40; 0 100 20; 0 0 1]\ndoffs=0\nbaseline=100\nndisp=100\n")),
               Error::Kind::bad_input, "ndisp: 100");
}

}  // namespace
}  // namespace swarmfit
