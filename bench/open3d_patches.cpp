// Open3D's detect_planar_patches (Araújo and Oliveira 2020). It gives boxes; a point goes to the nearest patch whose box it lies in.
#include <chrono>
#include <cmath>

#include <open3d/geometry/BoundingVolume.h>
#include <open3d/geometry/PointCloud.h>

#include "bench/contender.hpp"

namespace swarmfit::peers {
namespace {

class Open3dPatches final : public Contender {
 public:
  std::string name() const override { return "Open3D planar patches"; }
  std::string how() const override { return "normals and patches from 30 neighbours, 60 and 75 degrees, outlier ratio 0.75"; }

  void take(const Scene& scene, const Task& task) override {
    cloud_ = open3d::geometry::PointCloud();
    cloud_.points_.reserve(scene.size());
    for (std::size_t i = 0; i + 2 < scene.points.size(); i += 3) {
      cloud_.points_.emplace_back(scene.points[i], scene.points[i + 1], scene.points[i + 2]);
    }
    task_ = task;
  }

  Found run(std::uint64_t) override {
    Found found;
    const open3d::geometry::KDTreeSearchParamKNN neighbours(30);
    const auto start = std::chrono::steady_clock::now();
    cloud_.normals_.clear();
    cloud_.EstimateNormals(neighbours);
    found.normals_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    const auto patches = cloud_.DetectPlanarPatches(60, 75, 0.75, 0, task_.min_inliers, neighbours);
    for (const auto& patch : patches) {
      const Eigen::Vector3d normal = patch->R_.col(2);
      found.planes.push_back({{normal.x(), normal.y(), normal.z()}, -normal.dot(patch->center_)});
    }
    found.labels.assign(cloud_.points_.size(), 0);
    for (std::size_t i = 0; i < cloud_.points_.size(); ++i) {
      double least = task_.threshold;
      for (std::size_t k = 0; k < patches.size(); ++k) {
        const Eigen::Vector3d at = patches[k]->R_.transpose() * (cloud_.points_[i] - patches[k]->center_);
        const bool inside = std::abs(at.x()) <= patches[k]->extent_.x() / 2 && std::abs(at.y()) <= patches[k]->extent_.y() / 2;
        if (!inside || std::abs(at.z()) > least) continue;
        least = std::abs(at.z());
        found.labels[i] = static_cast<std::uint16_t>(k + 1);
      }
    }
    return found;
  }

 private:
  open3d::geometry::PointCloud cloud_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_open3d_patches) { return std::make_unique<Open3dPatches>(); }

}  // namespace swarmfit::peers
