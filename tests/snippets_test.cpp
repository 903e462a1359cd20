// The C++ of the how-to pages, compiled and run; tests/snippets/check.py holds the pages to these very lines. PCL is present by the shape
// of its types alone.
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/adapters/pcl.hpp>
#include <swarmfit/adapters/sac_segmentation.hpp>
#include <swarmfit/batch.hpp>
#include <swarmfit/swarmfit.hpp>

namespace pcl {
struct PointXYZ {
  float x, y, z, padding;
};
template <class PointT>
struct PointCloud {
  using PointType = PointT;
  std::vector<PointT> points;
  std::uint32_t width = 0, height = 1;
  bool is_dense = true;
};
struct PointIndices {
  std::vector<int> indices;
};
struct ModelCoefficients {
  std::vector<float> values;
};
enum { SACMODEL_PLANE = 0, SAC_RANSAC = 0 };
}  // namespace pcl

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// z = 0 with 900 points, x = 1 with 600.
std::shared_ptr<Cloud> floor_and_wall() {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> at(0, 1), noise(-0.004F, 0.004F);
  auto cloud = std::make_shared<Cloud>();
  for (int i = 0; i < 900; ++i) cloud->points.push_back({at(generator), at(generator), noise(generator), 1});
  for (int i = 0; i < 600; ++i) cloud->points.push_back({1 + noise(generator), at(generator), at(generator), 1});
  cloud->width = 1500;
  return cloud;
}

std::vector<std::size_t> extracted;
void extract(const Cloud&, const std::vector<int>& inliers) { extracted.push_back(inliers.size()); }

TEST(Snippets, PclByOneLine) {
  const auto cloud = floor_and_wall();
  const auto inliers = std::make_shared<pcl::PointIndices>();
  const auto coefficients = std::make_shared<pcl::ModelCoefficients>();
  swarmfit::SACSegmentation<pcl::PointXYZ> seg;  // was: pcl::SACSegmentation<pcl::PointXYZ> seg;
  seg.setOptimizeCoefficients(true);
  seg.setModelType(pcl::SACMODEL_PLANE);
  seg.setMethodType(pcl::SAC_RANSAC);  // taken, without effect
  seg.setDistanceThreshold(0.01);
  seg.setInputCloud(cloud);
  seg.segment(*inliers, *coefficients);  // both empty if there is none, and seg.error() says why
  ASSERT_EQ(coefficients->values.size(), 4U) << seg.error();
  EXPECT_NEAR(std::abs(coefficients->values[2]), 1, 1e-2);
  EXPECT_GE(inliers->indices.size(), 850U);
}

int all_planes_of(const std::shared_ptr<Cloud>& cloud) {
  swarmfit::FitOptions options;
  options.threshold = 0.01;  // in the cloud's unit
  const auto result = swarmfit::fit(swarmfit::adapters::view(*cloud), options);
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  for (const auto& inliers : swarmfit::adapters::indices_of_all(result->labels, result->models.size())) extract(*cloud, inliers);
  return 0;
}

TEST(Snippets, PclWithoutTheLoop) {
  EXPECT_EQ(all_planes_of(floor_and_wall()), 0);
  ASSERT_EQ(extracted.size(), 2U);
  EXPECT_GE(extracted[0], 850U);
  EXPECT_GE(extracted[1], 550U);
}

/// 1: the device is not there, which is said.
int on_a_device(const swarmfit::PointsView& points) {
  swarmfit::FitOptions options;
  options.backend = "vulkan";  // or part of a device's name: "NVIDIA", "Arc", "llvmpipe"
  options.pipeline_cache = "cache";
  auto fitter = swarmfit::Fitter::create(options);
  if (!fitter) {
    std::fprintf(stderr, "%s\n", fitter.error().message.c_str());
    return 1;
  }
  const auto result = fitter->fit(points);
  return result && result->models.size() == 2 && result->backend.name == "vulkan" ? 0 : 2;
}

TEST(Snippets, OnADevice) {
  const auto cloud = floor_and_wall();
  const int ended = on_a_device(swarmfit::adapters::view(*cloud));
  if (ended == 1) GTEST_SKIP() << "no Vulkan device can be used here";
  EXPECT_EQ(ended, 0);
}

TEST(Snippets, ManySmallClouds) {
  const auto one = floor_and_wall(), other = floor_and_wall();
  swarmfit::FitOptions options;
  options.threshold = 0.01;
  const std::vector<swarmfit::PointsView> clouds = {swarmfit::adapters::view(*one), swarmfit::adapters::view(*other)};
  const auto results = swarmfit::fit_batch(clouds, options);  // Expected<std::vector<Expected<FitResult>>>
  ASSERT_TRUE(results) << results.error().message;
  ASSERT_EQ(results->size(), 2U);
  for (const auto& result : *results) EXPECT_EQ(result.value().models.size(), 2U);
}

}  // namespace
