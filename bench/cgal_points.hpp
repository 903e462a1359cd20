// Points with normals as both CGAL contenders keep them.
#pragma once

#include <chrono>
#include <tuple>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

#include "bench/contender.hpp"

namespace swarmfit::peers {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// With its place in the input: Efficient RANSAC rearranges what it is given.
using PointWithNormal = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::uint32_t>;
using PointMap = CGAL::Nth_of_tuple_property_map<0, PointWithNormal>;
using NormalMap = CGAL::Nth_of_tuple_property_map<1, PointWithNormal>;
using Points = std::vector<PointWithNormal>;

inline constexpr unsigned kNormalNeighbours = 12;

inline Points cgal_points(const Scene& scene) {
  Points points;
  points.reserve(scene.size());
  for (std::size_t i = 0; i + 2 < scene.points.size(); i += 3) {
    points.emplace_back(Kernel::Point_3(scene.points[i], scene.points[i + 1], scene.points[i + 2]), Kernel::Vector_3(0, 0, 1),
                        static_cast<std::uint32_t>(i / 3));
  }
  return points;
}

/// Fills in the normals on all threads; milliseconds that took.
inline double estimate_normals(Points& points) {
  const auto start = std::chrono::steady_clock::now();
  CGAL::pca_estimate_normals<CGAL::Parallel_if_available_tag>(points, kNormalNeighbours,
                                                              CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

inline Plane to_plane(const Kernel::Plane_3& plane) {
  const Kernel::Vector_3 n = plane.orthogonal_vector();
  const double length = std::sqrt(n.squared_length());
  return {{n.x() / length, n.y() / length, n.z() / length}, plane.d() / length};
}

}  // namespace swarmfit::peers
