// CGAL's region growing over nearest neighbours.
#include <CGAL/Shape_detection/Region_growing/Region_growing.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing_on_point_set.h>
#include <CGAL/linear_least_squares_fitting_3.h>

#include "bench/cgal_points.hpp"

namespace swarmfit::peers {
namespace {

using Neighbours = CGAL::Shape_detection::Point_set::K_neighbor_query<Kernel, Points, PointMap>;
using Region = CGAL::Shape_detection::Point_set::Least_squares_plane_fit_region<Kernel, Points, PointMap, NormalMap>;
using Growing = CGAL::Shape_detection::Region_growing<Points, Neighbours, Region>;

constexpr std::size_t kNeighbours = 12;
constexpr double kDegrees = 25;

class CgalGrowing final : public Contender {
 public:
  std::string name() const override { return "CGAL region growing"; }
  std::string how() const override { return "PCA normals of 12 neighbours, 12 neighbours, 25 degrees"; }

  void take(const Scene& scene, const Task& task) override {
    points_ = cgal_points(scene);
    task_ = task;
  }

  Found run(std::uint64_t) override {
    Found found;
    found.normals_ms = estimate_normals(points_);
    Neighbours neighbours(points_, kNeighbours, PointMap());
    Region region(points_, task_.threshold, kDegrees, task_.min_inliers, PointMap(), NormalMap());
    Growing growing(points_, neighbours, region);
    std::vector<std::vector<std::size_t>> regions;
    growing.detect(std::back_inserter(regions));
    found.labels.assign(points_.size(), 0);
    for (const auto& members : regions) {
      std::vector<Kernel::Point_3> held;
      held.reserve(members.size());
      for (const std::size_t i : members) held.push_back(std::get<0>(points_[i]));
      Kernel::Plane_3 plane;
      CGAL::linear_least_squares_fitting_3(held.begin(), held.end(), plane, CGAL::Dimension_tag<0>());
      found.planes.push_back(to_plane(plane));
      for (const std::size_t i : members) found.labels[std::get<2>(points_[i])] = static_cast<std::uint16_t>(found.planes.size());
    }
    return found;
  }

 private:
  Points points_;
  Task task_;
};

}  // namespace

SWARMFIT_CONTENDER(make_cgal_growing) { return std::make_unique<CgalGrowing>(); }

}  // namespace swarmfit::peers
