// Built against the installed package alone. Exits with 0 if the plane it made is the plane it finds.
#include <swarmfit/swarmfit.hpp>

#include <cmath>
#include <cstdio>

int main() {
  // z = 0.5 over a unit square.
  Eigen::Matrix3Xd points(3, 400);
  for (int i = 0; i < 400; ++i) points.col(i) = Eigen::Vector3d(0.05 * (i % 20), 0.05 * (i / 20), 0.5);

  const auto result = swarmfit::fit(swarmfit::PointsView(points));
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  std::printf("%s\n", result->brief().c_str());
  if (result->models.size() != 1) return 1;
  const swarmfit::Model& plane = result->models.front();
  const bool right = std::abs(std::abs(plane.normal().z()) - 1) < 1e-6 && std::abs(std::abs(plane.offset()) - 0.5) < 1e-6;
  return right ? 0 : 1;
}
