// The planar segmentation of PCL's tutorial, and the same program after one line has changed, beside each other: once on the tutorial's
// fifteen points, once on a cloud from a file or, without one, on a floor and a wall among outliers. Exits with 0 if both find the plane.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include <pcl/ModelCoefficients.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/method_types.h>
#include <pcl/sample_consensus/model_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <swarmfit/adapters/sac_segmentation.hpp>
#include <swarmfit/cloud.hpp>

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

struct Found {
  pcl::ModelCoefficients coefficients;
  pcl::PointIndices inliers;
  double ms = 0;
};

// The tutorial's program; what changes is the type of seg.
template <class Segmentation>
Found segment(const Cloud::Ptr& cloud, double threshold) {
  const auto start = std::chrono::steady_clock::now();
  Found found;
  Segmentation seg;  // pcl::SACSegmentation<pcl::PointXYZ> seg;  ->  swarmfit::SACSegmentation<pcl::PointXYZ> seg;
  seg.setOptimizeCoefficients(true);
  seg.setModelType(pcl::SACMODEL_PLANE);
  seg.setMethodType(pcl::SAC_RANSAC);
  seg.setDistanceThreshold(threshold);
  seg.setInputCloud(cloud);
  seg.segment(found.inliers, found.coefficients);
  found.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return found;
}

void print(const char* who, const Found& found) {
  std::printf("%-26s", who);
  for (const float value : found.coefficients.values) std::printf(" %9.5f", static_cast<double>(value));
  std::printf("  %7zu inliers  %8.2f ms\n", found.inliers.indices.size(), found.ms);
}

/// z = 1 with three points off it, as in the tutorial.
Cloud::Ptr tutorial_cloud() {
  Cloud::Ptr cloud(new Cloud);
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> at(0, 1024);
  for (int i = 0; i < 15; ++i) cloud->push_back({at(generator), at(generator), 1.0F});
  (*cloud)[0].z = 2.0F;
  (*cloud)[3].z = -2.0F;
  (*cloud)[6].z = 4.0F;
  return cloud;
}

Cloud::Ptr floor_and_wall() {
  Cloud::Ptr cloud(new Cloud);
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> at(-2, 2);
  std::normal_distribution<float> noise(0, 0.004F);
  for (int i = 0; i < 60000; ++i) cloud->push_back({at(generator), at(generator), noise(generator)});
  for (int i = 0; i < 30000; ++i) cloud->push_back({2 + noise(generator), at(generator), at(generator)});
  for (int i = 0; i < 20000; ++i) cloud->push_back({at(generator), at(generator), at(generator)});
  return cloud;
}

bool side_by_side(const char* what, const Cloud::Ptr& cloud, double threshold) {
  std::printf("%s: %zu points, threshold %g\n", what, cloud->size(), threshold);
  const Found theirs = segment<pcl::SACSegmentation<pcl::PointXYZ>>(cloud, threshold);
  const Found ours = segment<swarmfit::SACSegmentation<pcl::PointXYZ>>(cloud, threshold);
  print("  pcl::SACSegmentation", theirs);
  print("  swarmfit::SACSegmentation", ours);
  return ours.coefficients.values.size() == 4 && 100 * ours.inliers.indices.size() >= 98 * theirs.inliers.indices.size();
}

}  // namespace

int main(int argc, char** argv) {
  bool right = side_by_side("the tutorial's cloud", tutorial_cloud(), 0.01);
  if (argc < 2) {
    right &= side_by_side("a floor and a wall", floor_and_wall(), 0.01);
  } else {
    const auto read = swarmfit::read_cloud(argv[1]);
    if (!read || read->dimension != 3 || read->values32.empty()) {
      std::fprintf(stderr, "%s\n", read ? "needs a cloud of x, y, z as floats" : read.error().message.c_str());
      return 1;
    }
    Cloud::Ptr cloud(new Cloud);
    for (std::size_t i = 0; i < read->values32.size(); i += 3) {
      const float* p = &read->values32[i];
      if (std::isfinite(p[0] + p[1] + p[2])) cloud->push_back({p[0], p[1], p[2]});
    }
    right &= side_by_side(argv[1], cloud, 0.02);
  }
  return right ? 0 : 1;
}
