// PCL's clouds and what its users expect back. Any type of PCL's shape will do; no header of PCL's is needed here.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <swarmfit/adapters/labels.hpp>
#include <swarmfit/cloud.hpp>
#include <swarmfit/model.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit::adapters {

/// pcl::PointXYZ and every point that has x, y and z.
template <class Point>
concept PclPoint = requires(const Point& p) {
  { p.x } -> std::convertible_to<float>;
  { p.y } -> std::convertible_to<float>;
  { p.z } -> std::convertible_to<float>;
};

/// pcl::PointCloud<Point>.
template <class Cloud>
concept PclCloud = requires(const Cloud& c) {
  c.points.size();
  c.width;
  c.height;
  requires PclPoint<typename Cloud::PointType>;
};

/// The cloud's own memory; `dimension` 2: x and y alone.
template <PclCloud PointCloud>
PointsView view(const PointCloud& cloud, int dimension = 3) {
  using Point = typename PointCloud::PointType;
  static_assert(std::same_as<decltype(Point::x), float>, "PCL's points are of float");
  if (cloud.points.empty()) return {nullptr, PointsView::Scalar::float32, dimension, 0, sizeof(Point)};
  return {&cloud.points.front().x, PointsView::Scalar::float32, dimension, cloud.points.size(), sizeof(Point)};
}

/// A copy of the points at `chosen`, tight; PointsView(copy, 3) looks at it.
template <PclCloud PointCloud, class Indices>
std::vector<float> gather(const PointCloud& cloud, const Indices& chosen) {
  std::vector<float> xyz;
  xyz.reserve(3 * chosen.size());
  for (const auto i : chosen) {
    const auto& p = cloud.points[static_cast<std::size_t>(i)];
    xyz.insert(xyz.end(), {p.x, p.y, p.z});
  }
  return xyz;
}

/// A copy with grid and colours, for a Perceiver.
template <PclCloud PointCloud>
Cloud to_cloud(const PointCloud& from) {
  Cloud cloud;
  cloud.width = static_cast<int>(from.height > 1 ? from.width : from.points.size());
  cloud.height = static_cast<int>(from.height > 1 ? from.height : 1);
  cloud.values32.reserve(3 * from.points.size());
  for (const auto& p : from.points) cloud.values32.insert(cloud.values32.end(), {p.x, p.y, p.z});
  if constexpr (requires(const typename PointCloud::PointType& p) { p.r, p.g, p.b; }) {
    cloud.rgb.reserve(3 * from.points.size());
    for (const auto& p : from.points) {
      cloud.rgb.insert(cloud.rgb.end(), {static_cast<std::uint8_t>(p.r), static_cast<std::uint8_t>(p.g), static_cast<std::uint8_t>(p.b)});
    }
  }
  return cloud;
}

/// pcl::ModelCoefficients: the order of PCL's plane, sphere, cylinder, circle and ours is the same.
template <class ModelCoefficients>
void to_coefficients(const Model& model, ModelCoefficients& coefficients) {
  coefficients.values.clear();
  for (const double value : model.parameters) coefficients.values.push_back(static_cast<float>(value) + 0.0F);  // no -0
}

}  // namespace swarmfit::adapters
