// PCL's SACSegmentation in a loop: the largest plane, its points out of the list of indices, the next.
#include <numeric>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include "bench/contender.hpp"

namespace swarmfit::peers {
namespace {

constexpr int kIterations = 1000;

class PclSacLoop final : public Contender {
 public:
  std::string name() const override { return "PCL SACSegmentation"; }
  std::string how() const override { return "RANSAC, at most 1000 iterations, probability 0.99, optimised, points removed by index"; }

  void take(const Scene& scene, const Task& task) override {
    cloud_ = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    cloud_->reserve(scene.size());
    for (std::size_t i = 0; i + 2 < scene.points.size(); i += 3) {
      cloud_->emplace_back(scene.points[i], scene.points[i + 1], scene.points[i + 2]);
    }
    task_ = task;
  }

  Found run(std::uint64_t) override {
    pcl::SACSegmentation<pcl::PointXYZ> segmentation(true);  // it seeds itself from the clock
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(task_.threshold);
    segmentation.setMaxIterations(kIterations);
    segmentation.setProbability(0.99);
    segmentation.setOptimizeCoefficients(true);
    segmentation.setNumberOfThreads(task_.threads > 1 ? task_.threads : -1);
    segmentation.setInputCloud(cloud_);
    auto open = std::make_shared<pcl::Indices>(cloud_->size());
    std::iota(open->begin(), open->end(), 0);
    Found found;
    found.labels.assign(cloud_->size(), 0);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients plane;
    while (open->size() >= task_.min_inliers && open->size() >= 3) {
      segmentation.setIndices(open);
      segmentation.segment(inliers, plane);
      if (inliers.indices.size() < task_.min_inliers || plane.values.size() != 4) break;
      found.planes.push_back({{plane.values[0], plane.values[1], plane.values[2]}, plane.values[3]});
      for (const auto i : inliers.indices) found.labels[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(found.planes.size());
      auto rest = std::make_shared<pcl::Indices>();
      rest->reserve(open->size() - inliers.indices.size());
      for (const auto i : *open) {
        if (found.labels[static_cast<std::size_t>(i)] == 0) rest->push_back(i);
      }
      open = rest;
    }
    return found;
  }

 private:
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_pcl_sac_loop) { return std::make_unique<PclSacLoop>(); }

}  // namespace swarmfit::peers
