// PCL's OrganizedMultiPlaneSegmentation, with the refinement its own demo uses.
#include <chrono>
#include <cmath>
#include <stdexcept>

#include <pcl/features/integral_image_normal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/organized_multi_plane_segmentation.h>

#include "bench/contender.hpp"

namespace swarmfit::peers {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

constexpr double kDegree = 0.017453292519943295;

class PclOrganized final : public Contender {
 public:
  std::string name() const override { return "PCL organized planes"; }
  std::string how() const override {
    return "integral-image normals (covariance, 0.03, 20 px), 3 degrees, steps up to 2 thresholds, refined";
  }
  bool organised() const override { return true; }

  void take(const Scene& scene, const Task& task) override {
    if (!scene.organised()) throw std::runtime_error("no image grid");
    cloud_ = std::make_shared<Cloud>(static_cast<std::uint32_t>(scene.width), static_cast<std::uint32_t>(scene.height));
    for (std::size_t i = 0; i < cloud_->size(); ++i) {
      (*cloud_)[i] = pcl::PointXYZ(scene.grid[3 * i], scene.grid[3 * i + 1], scene.grid[3 * i + 2]);
    }
    cloud_->is_dense = false;
    task_ = task;
  }

  Found run(std::uint64_t) override {
    Found found;
    const auto start = std::chrono::steady_clock::now();
    pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
    estimation.setNormalEstimationMethod(estimation.COVARIANCE_MATRIX);
    estimation.setMaxDepthChangeFactor(0.03F);
    estimation.setNormalSmoothingSize(20.0F);
    estimation.setInputCloud(cloud_);
    const auto normals = std::make_shared<Normals>();
    estimation.compute(*normals);
    found.normals_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();

    pcl::OrganizedMultiPlaneSegmentation<pcl::PointXYZ, pcl::Normal, pcl::Label> segmentation;
    segmentation.setMinInliers(static_cast<unsigned>(task_.min_inliers));
    segmentation.setAngularThreshold(3 * kDegree);
    segmentation.setDistanceThreshold(2 * task_.threshold);
    segmentation.setInputNormals(normals);
    segmentation.setInputCloud(cloud_);
    std::vector<pcl::PlanarRegion<pcl::PointXYZ>, Eigen::aligned_allocator<pcl::PlanarRegion<pcl::PointXYZ>>> regions;
    std::vector<pcl::ModelCoefficients> planes;
    std::vector<pcl::PointIndices> members, label_members, boundaries;
    auto labels = std::make_shared<pcl::PointCloud<pcl::Label>>();
    segmentation.segmentAndRefine(regions, planes, members, labels, label_members, boundaries);

    found.labels.assign(cloud_->size(), 0);
    for (std::size_t k = 0; k < planes.size() && k < members.size(); ++k) {
      const auto& v = planes[k].values;
      const double length = std::hypot(v[0], v[1], v[2]);
      found.planes.push_back({{v[0] / length, v[1] / length, v[2] / length}, v[3] / length});
      for (const auto i : members[k].indices) found.labels[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>(k + 1);
    }
    return found;
  }

 private:
  Cloud::Ptr cloud_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_pcl_organized) { return std::make_unique<PclOrganized>(); }

}  // namespace swarmfit::peers
