// Open3D's point clouds (open3d::geometry::PointCloud). Any type of that shape will do; no header of Open3D's is needed here.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include <swarmfit/adapters/labels.hpp>
#include <swarmfit/cloud.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit::adapters {

template <class Cloud>
concept Open3dCloud = requires(const Cloud& c) {
  { c.points_[0] } -> std::convertible_to<Eigen::Vector3d>;
  { c.colors_.size() } -> std::convertible_to<std::size_t>;
};

/// The cloud's own memory. indices<std::size_t>(result.labels, k) is what SelectByIndex takes.
template <Open3dCloud PointCloud>
PointsView view(const PointCloud& cloud) {
  const void* first = cloud.points_.empty() ? nullptr : cloud.points_.front().data();
  return {first, PointsView::Scalar::float64, 3, cloud.points_.size(), sizeof(Eigen::Vector3d)};
}

/// A copy with colours, for a Perceiver.
template <Open3dCloud PointCloud>
Cloud to_cloud(const PointCloud& from) {
  Cloud cloud;
  cloud.width = static_cast<int>(from.points_.size());
  cloud.height = 1;
  cloud.values64.reserve(3 * from.points_.size());
  for (const auto& p : from.points_) cloud.values64.insert(cloud.values64.end(), {p.x(), p.y(), p.z()});
  if (from.colors_.size() != from.points_.size()) return cloud;
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255)); };
  cloud.rgb.reserve(3 * from.points_.size());
  for (const auto& c : from.colors_) cloud.rgb.insert(cloud.rgb.end(), {byte(c.x()), byte(c.y()), byte(c.z())});
  return cloud;
}

}  // namespace swarmfit::adapters
