// Segmentation with fixation: borders in the picture, the log-polar grid, and the contours that come of them.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "host/perception/boundary.hpp"
#include "host/perception/polar_grid.hpp"
#include "host/perception/segmentation.hpp"
#include "tests/segmentation_fixture.hpp"

namespace swarmfit::perception {
namespace {

using test::Case, test::make_case, test::score;

Cloud picture(const cv::Mat3b& rgb) {
  Cloud cloud;
  cloud.width = rgb.cols;
  cloud.height = rgb.rows;
  cloud.rgb.assign(rgb.datastart, rgb.dataend);
  cloud.values32.assign(3 * rgb.total(), std::numeric_limits<float>::quiet_NaN());
  return cloud;
}

TEST(Boundary, IsProbableWhereColoursMeet) {
  cv::Mat3b image(40, 60, cv::Vec3b(150, 60, 60));
  image.colRange(30, 60).setTo(cv::Vec3b(60, 110, 60));
  const cv::Mat1f probability = boundary_probability(picture(image));
  ASSERT_EQ(probability.size(), image.size());
  for (int v = 0; v < 40; ++v) {
    EXPECT_GT(probability(v, 30), 0.8f);
    EXPECT_LE(probability(v, 30), 1.0f);
    for (const int u : {0, 10, 20, 40, 59}) EXPECT_LT(probability(v, u), 1e-3f) << u;
  }
}

TEST(Boundary, IsProbableWhereTexturesOfOneColourMeet) {
  std::mt19937 random(1);
  cv::Mat3b image(80, 120, cv::Vec3b(128, 128, 128));
  for (int v = 0; v < 80; ++v)
    for (int u = 60; u < 120; ++u) image(v, u) = random() % 2 == 0 ? cv::Vec3b(113, 113, 113) : cv::Vec3b(143, 143, 143);
  cv::Mat1f column;
  cv::reduce(boundary_probability(picture(image)), column, 0, cv::REDUCE_AVG);
  const double at_border = cv::mean(column.colRange(57, 63))[0], in_plain = cv::mean(column.colRange(10, 40))[0],
               in_texture = cv::mean(column.colRange(80, 110))[0];
  EXPECT_GT(at_border, in_texture + 0.1);
  EXPECT_LT(in_plain, 0.01);
}

TEST(PolarGrid, CellsHoldTheirPixelsAndRingsClose) {
  for (const auto& [fixation, rect] : {std::pair{cv::Point(30, 40), cv::Rect(10, 20, 60, 50)},
                                       {cv::Point(0, 0), cv::Rect(0, 0, 300, 200)},
                                       {cv::Point(5, 5), cv::Rect(5, 5, 1, 1)},
                                       {cv::Point(700, 90), cv::Rect(0, 0, 1280, 720)}}) {
    const PolarGrid grid(fixation, rect, 0);
    EXPECT_TRUE(grid.innermost(grid.cell(fixation)));
    for (int v = rect.y; v < rect.br().y; v += 3)
      for (int u = rect.x; u < rect.br().x; u += 3) {
        const cv::Point pixel(u, v), back = grid.pixel(grid.cell(pixel));
        const double radius = cv::norm(pixel - fixation);
        EXPECT_LE(cv::norm(pixel - back), 2 + 0.08 * radius) << pixel << " about " << fixation;
      }
    const auto graph = grid.make_graph();
    for (std::int32_t cell = 0; cell < grid.cells(); ++cell) {
      const bool edge = grid.innermost(cell) || cell >= grid.cells() - grid.angles();
      ASSERT_EQ(graph.last_arc(cell) - graph.first_arc(cell), edge ? 3 : 4);
      for (auto a = graph.first_arc(cell); a < graph.last_arc(cell); ++a) {
        ASSERT_EQ(graph.arc(graph.arc(a).mate).head, cell);
        ASSERT_EQ(graph.arc(graph.arc(a).mate).mate, a);
      }
    }
  }
}

/// A disc of another colour, in noise, of which the sensor saw all but a rim of 15 pixels, and nothing of what is around.
struct Disc {
  Cloud frame;
  std::vector<std::uint16_t> planes, popout, truth;
  std::vector<SpaceOfInterest> sois{1};
  SegmentationInput input() const { return {frame, planes, popout, sois}; }
};
Disc make_disc(cv::Point centre, int radius) {
  std::mt19937 random(3);
  cv::Mat3b image(480, 640, cv::Vec3b(150, 140, 130));
  cv::circle(image, centre, radius, cv::Scalar(70, 90, 150), cv::FILLED);
  Disc disc;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) disc.truth.push_back(image(v, u)[0] == 70);
  for (cv::Vec3b& pixel : image)
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(pixel[c] + static_cast<int>(random() % 9));
  disc.frame = picture(image);
  disc.planes.assign(image.total(), 0);
  disc.popout.assign(image.total(), 0);
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      if (cv::norm(cv::Point(u, v) - centre) > radius - 15) continue;
      const auto i = static_cast<std::size_t>(v * image.cols + u);
      disc.popout[i] = 1;
      disc.frame.values32[3 * i] = static_cast<float>(u - 320) / 525;
      disc.frame.values32[3 * i + 1] = static_cast<float>(v - 240) / 525;
      disc.frame.values32[3 * i + 2] = 1;
    }
  disc.sois[0].centre = {(centre.x - 320) / 525.0, (centre.y - 240) / 525.0, 1};
  disc.sois[0].radius = 1.2 * radius / 525;
  const int reach = radius + 10;
  const cv::Rect box = cv::Rect(centre.x - reach, centre.y - reach, 2 * reach, 2 * reach) & cv::Rect(0, 0, 640, 480);
  disc.sois[0].bbox = {box.x, box.y, box.width, box.height};
  return disc;
}

double overlap(const std::vector<std::uint16_t>& truth, const std::vector<std::uint16_t>& found) {
  double both = 0, either = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    both += truth[i] > 0 && found[i] == truth[i];
    either += truth[i] > 0 || found[i] > 0;
  }
  return both / either;
}

PerceiveOptions with_fixation() {
  PerceiveOptions options;
  options.segmentation = Segmentation::fixation;
  return options;
}

TEST(Fixation, TheContourFollowsColourWhereThereIsNoDepth) {
  for (const int radius : {30, 50, 80}) {
    const Disc disc = make_disc({300, 200}, radius);
    const auto objects = segment_objects(disc.input(), with_fixation());
    EXPECT_GT(overlap(disc.truth, objects), 0.93) << radius;
    EXPECT_LT(overlap(disc.truth, disc.popout), 0.7) << "what the sensor saw alone";
  }
}

TEST(Fixation, TheContourEndsWithThePicture) {
  const Disc disc = make_disc({20, 240}, 60);
  EXPECT_GT(overlap(disc.truth, segment_objects(disc.input(), with_fixation())), 0.93);
}

TEST(Fixation, OutlinesTheScenesObjects) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Case c = make_case(seed);
    const auto objects = segment_objects(c.input(), with_fixation());
    EXPECT_GT(score(c, objects).f, 0.95) << "seed " << seed;
    EXPECT_GT(score(c, objects).holes, 0.85) << "seed " << seed;
    EXPECT_EQ(std::count(objects.begin(), objects.end(), kUncertain), 0);
  }
}

TEST(Fixation, AnyNumberOfThreadsGivesTheSame) {
  const Case c = make_case(1, 320, 240);
  PerceiveOptions options = with_fixation();
  options.fit.threads = 1;
  const auto once = segment_objects(c.input(), options);
  for (const int threads : {2, 0}) {
    options.fit.threads = threads;
    EXPECT_EQ(segment_objects(c.input(), options), once);
  }
  const Case doubles = c.in_doubles();
  EXPECT_EQ(segment_objects(doubles.input(), options), once);
}

TEST(Fixation, EdgeCasesAreAnswered) {
  const Case c = make_case(1, 160, 120);
  const std::size_t size = c.scene.cloud.size();
  const std::vector<std::uint16_t> nothing(size, 0);
  const std::vector<SpaceOfInterest> none;
  EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, c.popout, none}, with_fixation()), nothing);
  EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, nothing, c.sois}, with_fixation()), nothing) << "SOIs of which no pixel is left";
  // One SOI that is the whole image, one that is one pixel, one whose centre is the camera.
  std::vector<std::uint16_t> popout(size, 1);
  EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, popout, c.sois}, with_fixation()).size(), size);
  popout.assign(size, 0);
  popout[0] = 1;
  EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, popout, c.sois}, with_fixation())[0], 1);
  auto sois = c.sois;
  for (auto& soi : sois) soi.centre.setZero();
  EXPECT_EQ(segment_objects({c.scene.cloud, c.planes, c.popout, sois}, with_fixation()).size(), size);
}

}  // namespace
}  // namespace swarmfit::perception
