// Open3D's segment_plane in a loop: the largest plane, the cloud without its points, the next.
#include <numeric>

#include <open3d/geometry/PointCloud.h>
#include <open3d/utility/Random.h>

#include "bench/contender.hpp"

namespace swarmfit::peers {
namespace {

constexpr int kIterations = 1000;

class Open3dSegment final : public Contender {
 public:
  std::string name() const override { return "Open3D segment_plane"; }
  std::string how() const override { return "at most 1000 iterations, probability 0.99, the rest selected by index"; }

  void take(const Scene& scene, const Task& task) override {
    cloud_ = std::make_shared<open3d::geometry::PointCloud>();
    cloud_->points_.reserve(scene.size());
    for (std::size_t i = 0; i + 2 < scene.points.size(); i += 3) {
      cloud_->points_.emplace_back(scene.points[i], scene.points[i + 1], scene.points[i + 2]);
    }
    task_ = task;
  }

  Found run(std::uint64_t seed) override {
    open3d::utility::random::Seed(static_cast<int>(seed));
    Found found;
    found.labels.assign(cloud_->points_.size(), 0);
    std::vector<std::size_t> where(cloud_->points_.size());
    std::iota(where.begin(), where.end(), std::size_t{0});
    auto rest = cloud_;
    while (where.size() >= task_.min_inliers && where.size() >= 3) {
      const auto [plane, inliers] = rest->SegmentPlane(task_.threshold, 3, kIterations, 0.99);
      if (inliers.size() < task_.min_inliers) break;
      found.planes.push_back({{plane[0], plane[1], plane[2]}, plane[3]});
      for (const std::size_t i : inliers) found.labels[where[i]] = static_cast<std::uint16_t>(found.planes.size());
      rest = rest->SelectByIndex(inliers, true);
      std::erase_if(where, [&](std::size_t i) { return found.labels[i] != 0; });
    }
    return found;
  }

 private:
  std::shared_ptr<open3d::geometry::PointCloud> cloud_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_open3d_segment) { return std::make_unique<Open3dSegment>(); }

}  // namespace swarmfit::peers
