// The built-in scene as the outlines' cuts take it, and how well outlines agree with its truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <swarmfit/scene.hpp>

#include "host/perception/segmentation.hpp"

namespace swarmfit::test {

/// A scene whose pop-out comes from the truth: seen points of objects, but those within a millimetre or eight of the support.
struct Case {
  Scene scene;
  std::vector<std::uint16_t> planes, popout;
  std::vector<SpaceOfInterest> sois;
  perception::SegmentationInput input() const { return {scene.cloud, planes, popout, sois}; }
  /// The same, its coordinates in double precision.
  Case in_doubles() const {
    Case other = *this;
    other.scene.cloud.values64.assign(scene.cloud.values32.begin(), scene.cloud.values32.end());
    other.scene.cloud.values32.clear();
    return other;
  }
};

inline Case make_case(std::uint64_t seed, int width = 640, int height = 480) {
  Case c{make_room_scene(seed, width, height), {}, {}, {}};
  const Cloud& cloud = c.scene.cloud;
  const auto at = [&](std::size_t i) -> Eigen::Vector3d {
    return {cloud.values32[3 * i], cloud.values32[3 * i + 1], cloud.values32[3 * i + 2]};
  };
  c.planes.assign(cloud.size(), 0);
  c.popout.assign(cloud.size(), 0);
  c.sois.resize(c.scene.truth.objects);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!std::isfinite(cloud.values32[3 * i + 2])) continue;
    const auto k = c.scene.truth.object_labels[i];
    const auto support = k > 0 ? c.scene.truth.object_planes[k - 1] : c.scene.truth.plane_labels[i];
    if (support == 0) continue;
    const Eigen::Vector4d& plane = c.scene.truth.planes[support - 1U];
    if (std::abs(plane.head<3>().dot(at(i)) + plane[3]) < 0.008) c.planes[i] = support;
    if (k == 0) continue;
    c.sois[k - 1].plane = support;
    if (c.planes[i] != 0) continue;
    c.popout[i] = k;
    c.sois[k - 1].centre += at(i);
    ++c.sois[k - 1].points;
  }
  for (auto& soi : c.sois) soi.centre /= static_cast<double>(std::max<std::size_t>(soi.points, 1));
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (const auto k = c.popout[i]; k > 0)
      c.sois[k - 1].radius = std::max(c.sois[k - 1].radius, 1.15 * (at(i) - c.sois[k - 1].centre).norm());
  return c;
}

struct Score {
  double f, holes;  // over all pixels; over those of objects without depth: the share that got its label
};
inline Score score(const Case& c, const std::vector<std::uint16_t>& objects) {
  double hit = 0, found = 0, there = 0, holes = 0, filled = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto truth = c.scene.truth.object_labels[i];
    const std::uint16_t got = objects[i] == kUncertain ? 0 : objects[i];
    hit += truth > 0 && got == truth;
    found += got > 0;
    there += truth > 0;
    if (truth > 0 && !std::isfinite(c.scene.cloud.values32[3 * i + 2])) {
      ++holes;
      filled += got == truth;
    }
  }
  return {2 * hit / (found + there), filled / holes};
}

}  // namespace swarmfit::test
