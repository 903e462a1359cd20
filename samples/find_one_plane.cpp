// Find the plane in a cloud half of which is clutter.
#include <swarmfit/swarmfit.hpp>

#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

int main() {
  // A table top, z = 0.7 m with 2 mm of noise, and as many points anywhere above it.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> anywhere(0, 1);
  std::normal_distribution<float> noise(0, 0.002f);
  std::vector<float> xyz;
  for (int i = 0; i < 5000; ++i) {
    xyz.insert(xyz.end(), {anywhere(random), anywhere(random), 0.7f + noise(random)});
    xyz.insert(xyz.end(), {anywhere(random), anywhere(random), 0.7f + anywhere(random)});
  }

  swarmfit::FitOptions options;
  options.model = swarmfit::ModelType::plane;
  options.threshold = 0.01;  // m
  options.max_models = 1;
  const auto result = swarmfit::fit(swarmfit::PointsView(xyz, 3), options);
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  if (result->models.empty()) return 1;

  const swarmfit::Model& plane = result->models.front();
  const Eigen::Vector3d n = plane.normal();
  std::printf("%.4f x %+.4f y %+.4f z %+.4f = 0, %zu of %zu points\n", n.x(), n.y(), n.z(), plane.offset(), plane.inliers,
              result->finite_points);

  const bool right = std::abs(n.z()) > 0.9999 && std::abs(std::abs(plane.offset()) - 0.7) < 0.002 && plane.inliers > 4900;
  return right ? 0 : 1;
}
