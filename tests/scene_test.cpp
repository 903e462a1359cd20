// The synthetic room: what it promises about truth, noise, holes and repetition.
#include <swarmfit/scene.hpp>

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

namespace swarmfit {
namespace {

Eigen::Vector3d point(const Cloud& cloud, std::size_t i) {
  return {cloud.values32[3 * i], cloud.values32[3 * i + 1], cloud.values32[3 * i + 2]};
}
bool finite(const Cloud& cloud, std::size_t i) { return std::isfinite(cloud.values32[3 * i + 2]); }
double sigma(double z) { return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4); }

std::uint64_t fingerprint(const Scene& scene) {
  std::uint64_t hash = 1469598103934665603U;  // FNV-1a
  const auto add = [&](const void* data, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211U;
  };
  add(scene.cloud.rgb.data(), scene.cloud.rgb.size());
  for (const float value : scene.cloud.values32) {
    const std::uint32_t bits = std::isnan(value) ? 0U : [&] {
      std::uint32_t b = 0;
      std::memcpy(&b, &value, sizeof b);
      return b;
    }();
    add(&bits, sizeof bits);
  }
  return hash;
}

TEST(Scene, IsAnOrganisedColouredCloudWithTruthForEveryPixel) {
  const Scene scene = make_room_scene(1, 320, 240);
  EXPECT_TRUE(scene.cloud.organised());
  EXPECT_EQ(scene.cloud.width, 320);
  EXPECT_EQ(scene.cloud.height, 240);
  EXPECT_EQ(scene.cloud.size(), 320U * 240U);
  EXPECT_EQ(scene.cloud.rgb.size(), 3U * 320U * 240U);
  EXPECT_EQ(scene.truth.plane_labels.size(), scene.cloud.size());
  EXPECT_EQ(scene.truth.object_labels.size(), scene.cloud.size());
  EXPECT_EQ(scene.truth.object_names.size(), scene.truth.objects);
  ASSERT_TRUE(scene.cloud.intrinsics.has_value());
  EXPECT_DOUBLE_EQ(scene.cloud.intrinsics->fx, 262.5);
}

TEST(Scene, RepeatsItselfToTheBit) {
  EXPECT_EQ(fingerprint(make_room_scene(7, 160, 120)), fingerprint(make_room_scene(7, 160, 120)));
  EXPECT_NE(fingerprint(make_room_scene(7, 160, 120)), fingerprint(make_room_scene(8, 160, 120)));
  // The same on every machine: nothing in the scene rounds differently from one to the next.
  EXPECT_EQ(fingerprint(make_room_scene(1, 160, 120)), 12250203389076974587U);
}

TEST(Scene, EveryLayerIsLoadedAndEveryObjectSeen) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    const Scene scene = make_room_scene(seed, 320, 240);
    EXPECT_EQ(scene.truth.planes.size(), 5U);  // floor, table, three boards
    EXPECT_GE(scene.truth.objects, 9U) << "seed " << seed;
    std::vector<std::size_t> seen(scene.truth.objects + 1);
    for (const auto k : scene.truth.object_labels) {
      ASSERT_LE(k, scene.truth.objects);
      ++seen[k];
    }
    for (std::size_t k = 1; k < seen.size(); ++k) EXPECT_GE(seen[k] * 1500, scene.cloud.size()) << "seed " << seed << " object " << k;
    ASSERT_FALSE(scene.pictures.empty()) << "seed " << seed;
    for (const auto& picture : scene.pictures) {
      EXPECT_EQ(picture.rgb.size(), 3U * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height));
      ASSERT_LE(picture.object, scene.truth.objects);
      if (picture.object > 0) {
        EXPECT_EQ(scene.truth.object_names[picture.object - 1], "carton");
      }
    }
  }
}

TEST(Scene, SupportsLieOnTheirPlanesWithinTheSensorsNoise) {
  const Scene scene = make_room_scene(3);
  std::vector<double> square(6), count(6);
  double near = 0, far = 0, near_count = 0, far_count = 0;
  for (std::size_t i = 0; i < scene.cloud.size(); ++i) {
    const auto k = scene.truth.plane_labels[i];
    if (k == 0 || !finite(scene.cloud, i)) continue;
    const Eigen::Vector4d& plane = scene.truth.planes[k - 1];
    const Eigen::Vector3d x = point(scene.cloud, i);
    const double along_ray = (plane.head<3>().dot(x) + plane[3]) / (plane.head<3>().dot(x) / x.z());  // as depth
    square[k] += along_ray * along_ray / (sigma(x.z()) * sigma(x.z()));
    ++count[k];
    (x.z() < 1.2 ? near : far) += along_ray * along_ray;
    ++(x.z() < 1.2 ? near_count : far_count);
  }
  for (std::size_t k = 1; k <= 5; ++k) {
    ASSERT_GT(count[k], 5000) << "support " << k;
    // The noise as stated, and the sensor's steps on top of it.
    EXPECT_GT(std::sqrt(square[k] / count[k]), 0.95) << "support " << k;
    EXPECT_LT(std::sqrt(square[k] / count[k]), 1.45) << "support " << k;
    EXPECT_NEAR(scene.truth.planes[k - 1].head<3>().norm(), 1, 1e-12);
    EXPECT_GT(scene.truth.planes[k - 1][3], 0) << "the camera is above it, and n points up";
  }
  EXPECT_GT(far / far_count, 2 * near / near_count) << "noise grows with depth";
}

TEST(Scene, ObjectsStandOnASupport) {
  const Scene scene = make_room_scene(2);
  std::vector<double> lowest(scene.truth.objects + 1, 10);
  for (std::size_t i = 0; i < scene.cloud.size(); ++i) {
    const auto k = scene.truth.object_labels[i];
    if (k == 0 || !finite(scene.cloud, i)) continue;
    const Eigen::Vector4d& plane = scene.truth.planes[scene.truth.object_planes[k - 1] - 1U];
    lowest[k] = std::min(lowest[k], plane.head<3>().dot(point(scene.cloud, i)) + plane[3]);
  }
  for (std::size_t k = 1; k < lowest.size(); ++k) {
    EXPECT_LT(lowest[k], 0.02) << "object " << k << " floats";
    EXPECT_GT(lowest[k], -0.03) << "object " << k << " sinks";
  }
}

TEST(Scene, HasHolesAtEdgesAndPatches) {
  const Scene scene = make_room_scene(1);
  std::size_t holes = 0, at_edges = 0, edges = 0;
  for (int v = 0; v < 480; ++v)
    for (int u = 1; u < 640; ++u) {
      const auto i = static_cast<std::size_t>(v * 640 + u);
      const bool edge = (scene.truth.object_labels[i] == 0) != (scene.truth.object_labels[i - 1] == 0);
      holes += !finite(scene.cloud, i);
      edges += edge;
      at_edges += edge && !finite(scene.cloud, i);
    }
  EXPECT_GT(holes, 640U * 480U / 100);
  EXPECT_LT(holes, 640U * 480U / 8);
  EXPECT_GT(at_edges * 4, edges);
}

TEST(Scene, TinyImagesAreAnswered) {
  const Scene scene = make_room_scene(1, 1, 1);
  EXPECT_EQ(scene.cloud.size(), 1U);
  EXPECT_EQ(scene.truth.planes.size(), 5U);
}

}  // namespace
}  // namespace swarmfit
