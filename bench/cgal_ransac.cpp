// CGAL's Efficient RANSAC (Schnabel, Wahl, Klein 2007).
#include <CGAL/Shape_detection/Efficient_RANSAC.h>

#include "bench/cgal_points.hpp"

namespace swarmfit::peers {
namespace {

using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Points, PointMap, NormalMap>;
using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
using PlaneShape = CGAL::Shape_detection::Plane<Traits>;

constexpr double kClusterThresholds = 5;

class CgalRansac final : public Contender {
 public:
  std::string name() const override { return "CGAL Efficient RANSAC"; }
  std::string how() const override { return "PCA normals of 12 neighbours, 25 degrees, pieces parted by 5 thresholds, probability 0.01"; }

  void take(const Scene& scene, const Task& task) override {
    points_ = cgal_points(scene);
    task_ = task;
  }

  Found run(std::uint64_t seed) override {
    CGAL::get_default_random() = CGAL::Random(static_cast<unsigned>(seed));
    Found found;
    found.normals_ms = estimate_normals(points_);
    Ransac ransac;
    ransac.set_input(points_);
    ransac.add_shape_factory<PlaneShape>();
    Ransac::Parameters parameters;
    parameters.probability = 0.01;
    parameters.min_points = task_.min_inliers;
    parameters.epsilon = task_.threshold;
    parameters.cluster_epsilon = kClusterThresholds * task_.threshold;
    parameters.normal_threshold = 0.906;
    ransac.detect(parameters);
    found.labels.assign(points_.size(), 0);
    for (const auto& shape : ransac.shapes()) {
      const auto* plane = dynamic_cast<const PlaneShape*>(shape.get());
      if (plane == nullptr) continue;
      const auto surface = static_cast<Kernel::Plane_3>(*plane);
      found.planes.push_back(to_plane(surface));
      // It assigns points up to three times its epsilon away; those beyond the threshold are left unlabelled.
      for (const std::size_t i : plane->indices_of_assigned_points()) {
        if (CGAL::squared_distance(std::get<0>(points_[i]), surface) > task_.threshold * task_.threshold) continue;
        found.labels[std::get<2>(points_[i])] = static_cast<std::uint16_t>(found.planes.size());
      }
    }
    return found;
  }

 private:
  Points points_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_cgal_ransac) { return std::make_unique<CgalRansac>(); }

}  // namespace swarmfit::peers
