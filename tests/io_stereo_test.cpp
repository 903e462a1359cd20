#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <swarmfit/cloud.hpp>

#include "host/io/rectify.hpp"
#include "host/io/stereo.hpp"
#include "tests/io_files.hpp"

namespace swarmfit {
namespace {

using tests::data_folder;

struct Errors {
  double density = 0;  ///< share of pixels with a disparity, of those with a true one
  double bad = 0;      ///< share of these that are off by more than 2 px
  double median = 0;   ///< of d - truth [px]: a bias
};

Errors errors(const cv::Mat& d, const cv::Mat& truth, const cv::Mat& mask) {
  std::vector<double> off;
  std::size_t known = 0, bad = 0;
  for (int v = 0; v < d.rows; ++v) {
    for (int u = 0; u < d.cols; ++u) {
      if (!std::isfinite(truth.at<float>(v, u)) || (!mask.empty() && mask.at<std::uint8_t>(v, u) != 255)) continue;
      ++known;
      if (!std::isfinite(d.at<float>(v, u))) continue;
      off.push_back(d.at<float>(v, u) - truth.at<float>(v, u));
      bad += std::abs(off.back()) > 2;
    }
  }
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
  return {static_cast<double>(off.size()) / static_cast<double>(known), static_cast<double>(bad) / static_cast<double>(off.size()),
          off[off.size() / 2]};
}

cv::Mat read_pfm(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string magic;
  int width = 0, height = 0;
  double scale = 0;
  in >> magic >> width >> height >> scale;
  in.get();
  cv::Mat image(height, width, CV_32F);
  for (int v = height - 1; v >= 0; --v) in.read(image.ptr<char>(v), static_cast<std::streamsize>(sizeof(float)) * width);
  return magic == "Pf" && scale < 0 && in ? image : cv::Mat();
}

TEST(Stereo, ASlantedPlane) {
  constexpr int kWidth = 320, kHeight = 200;
  cv::RNG random(5);
  cv::Mat noise(kHeight, 2 * kWidth, CV_8UC3), texture;
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, texture, {}, 1.5);
  // Right (x, v) shows texture (x + 40, v); left (u, v) the same point at u = x + d, where d grows with v and shrinks with u.
  cv::Mat left_map(kHeight, kWidth, CV_32FC2), right = texture.colRange(40, 40 + kWidth).clone(), truth(kHeight, kWidth, CV_32F), left;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const float d = 10 + 0.05F * static_cast<float>(v) - 0.02F * static_cast<float>(u);
      truth.at<float>(v, u) = static_cast<float>(u) - d >= 0 ? d : NAN;
      left_map.at<cv::Vec2f>(v, u) = {static_cast<float>(u) - d + 40, static_cast<float>(v)};
    }
  }
  cv::remap(texture, left, left_map, cv::Mat(), cv::INTER_CUBIC);
  const Errors e = errors(io::disparity_map(left, right, 32), truth, {});
  EXPECT_GT(e.density, 0.9);
  EXPECT_LT(e.bad, 0.005);
  EXPECT_LT(std::abs(e.median), 0.1);
}

/// A textured floor that both cameras see; the right image is turned by `turn` [rad] about its middle and `down` pixels lower.
struct TiltedPair {
  cv::Mat left, right;
};

TiltedPair tilted_pair(double turn, double down) {
  constexpr int kWidth = 320, kHeight = 240;
  cv::RNG random(9);
  cv::Mat noise(kHeight + 40, 2 * kWidth, CV_8UC3), texture;
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, texture, {}, 1.5);
  cv::Mat left_map(kHeight, kWidth, CV_32FC2), right_map(kHeight, kWidth, CV_32FC2);
  TiltedPair pair;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double x = u - 0.5 * kWidth, y = v - 0.5 * kHeight;
      left_map.at<cv::Vec2f>(v, u) = {static_cast<float>(u - 8 - 0.05 * v + 60), static_cast<float>(v + 20)};
      right_map.at<cv::Vec2f>(v, u) = {static_cast<float>(u + turn * y + 60), static_cast<float>(v - down - turn * x + 20)};
    }
  }
  cv::remap(texture, pair.left, left_map, cv::Mat(), cv::INTER_CUBIC);
  cv::remap(texture, pair.right, right_map, cv::Mat(), cv::INTER_CUBIC);
  return pair;
}

TEST(Stereo, RowsThatDoNotMeetAreMeasured) {
  const auto pair = tilted_pair(0.002, 0.4);
  cv::Mat left, right;
  cv::cvtColor(pair.left, left, cv::COLOR_RGB2GRAY);
  cv::cvtColor(pair.right, right, cv::COLOR_RGB2GRAY);
  const auto shift = io::row_shift(left, right, 32);
  ASSERT_TRUE(shift);
  EXPECT_NEAR((*shift)[0], 0.4, 0.03);
  // Half a width to the side, a tenth of a pixel.
  EXPECT_NEAR((*shift)[1], 0.002 * 320, 0.2);
  EXPECT_NEAR((*shift)[2], 0, 0.2);
}

TEST(Stereo, LevelRowsAreLeftAloneAndOthersBroughtLevel) {
  const auto straight = tilted_pair(0, 0);
  EXPECT_EQ(io::level_rows(straight.left, straight.right, 32).data, straight.right.data);
  const auto tilted = tilted_pair(0.002, 0.4);
  const cv::Mat level = io::level_rows(tilted.left, tilted.right, 32);
  cv::Mat grey, left;
  cv::cvtColor(level, grey, cv::COLOR_RGB2GRAY);
  cv::cvtColor(tilted.left, left, cv::COLOR_RGB2GRAY);
  const auto rest = io::row_shift(left, grey, 32);
  ASSERT_TRUE(rest);
  EXPECT_NEAR((*rest)[0], 0, 0.03);
  EXPECT_NEAR((*rest)[1], 0, 0.2);
  EXPECT_NEAR((*rest)[2], 0, 0.2);
}

TEST(Stereo, APairWithoutCornersKeepsItsRows) {
  const cv::Mat blank(100, 160, CV_8UC3, cv::Scalar(90, 90, 90));
  EXPECT_EQ(io::level_rows(blank, blank, 32).data, blank.data);
  const cv::Mat tiny(9, 9, CV_8UC3, cv::Scalar(90, 90, 90));
  EXPECT_EQ(io::level_rows(tiny, tiny, 16).data, tiny.data);
}

TEST(Stereo, MetresAndIntrinsicsOfTheLeftImage) {
  const tests::TemporaryFolder folder;
  cv::RNG random(5);
  cv::Mat noise(120, 200, CV_8UC3), texture;
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, texture, {}, 1.2);
  cv::imwrite((folder / "l.png").string(), texture.colRange(0, 160));
  cv::imwrite((folder / "r.png").string(), texture.colRange(8, 168));  // every disparity is 8
  folder.put("calib.txt", " cam0= [ 200 0 80 ; 0 200 60 ; 0 0 1 ]\ndoffs= 2\nbaseline = 100 \n ndisp= 20\n");
  const auto cloud = read_stereo(folder / "l.png", folder / "r.png", folder / "calib.txt");
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->width, 160);
  ASSERT_TRUE(cloud->intrinsics);
  EXPECT_EQ(cloud->intrinsics->cx, 80);
  EXPECT_EQ(cloud->rgb.size(), static_cast<std::size_t>(3 * 160 * 120));
  const float* p = &cloud->values32[3 * (70 * 160 + 100)];
  EXPECT_NEAR(p[2], 0.1 * 200 / (8 + 2), 0.01);  // Z = baseline f / (d + doffs)
  EXPECT_NEAR(p[0], p[2] * (100 - 80) / 200, 1e-5);
  EXPECT_NEAR(p[1], p[2] * (70 - 60) / 200, 1e-5);
}

class StereoRealData : public testing::TestWithParam<const char*> {};

TEST_P(StereoRealData, AgreesWithTheTrueDisparities) {
  if (data_folder().empty()) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set: no real pairs to match";
  const auto folder = data_folder() / "middlebury" / GetParam();
  const cv::Mat truth = read_pfm(folder / "disp0GT.pfm");
  ASSERT_FALSE(truth.empty());
  const cv::Mat mask = cv::imread((folder / "mask0nocc.png").string(), cv::IMREAD_GRAYSCALE);
  cv::Mat left = cv::imread((folder / "im0.png").string()), right = cv::imread((folder / "im1.png").string());
  cv::cvtColor(left, left, cv::COLOR_BGR2RGB);
  cv::cvtColor(right, right, cv::COLOR_BGR2RGB);
  const cv::Mat d = io::disparity_map(left, io::level_rows(left, right, 80), 80);
  const Errors e = errors(d, truth, mask);
  RecordProperty("density", std::to_string(e.density));
  RecordProperty("bad2", std::to_string(e.bad));
  RecordProperty("median", std::to_string(e.median));
  EXPECT_GT(e.density, 0.8);
  EXPECT_LT(e.bad, GetParam() == std::string("Shelves") ? 0.25 : 0.08);
  EXPECT_LT(std::abs(e.median), 0.3);
}

INSTANTIATE_TEST_SUITE_P(Middlebury, StereoRealData, testing::Values("Playtable", "Shelves", "Adirondack"),
                         [](const auto& pair) { return std::string(pair.param); });

class CloudRealData : public testing::Test {};

TEST_F(CloudRealData, EveryCloudIsRead) {
  if (data_folder().empty()) GTEST_SKIP() << "SWARMFIT_DATA_DIR is not set: no real clouds to read";
  std::size_t seen = 0;
  for (const char* sub : {"mosd", "clouds", "toldo", "adelaide_h", "adelaide_f"}) {
    for (const auto& entry : std::filesystem::directory_iterator(data_folder() / sub)) {
      const auto cloud = read_cloud(entry.path());
      ASSERT_TRUE(cloud) << cloud.error().message;
      EXPECT_GT(cloud->size(), 0U);
      EXPECT_EQ(cloud->size(), static_cast<std::size_t>(cloud->width) * static_cast<std::size_t>(cloud->height));
      if (std::string(sub) == "mosd") {
        EXPECT_TRUE(cloud->organised() && cloud->coloured() && cloud->width == 640);
      }
      ++seen;
    }
  }
  EXPECT_GT(seen, 20U);
}

}  // namespace
}  // namespace swarmfit
