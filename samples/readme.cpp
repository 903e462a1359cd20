#include <swarmfit/swarmfit.hpp>

#include <cstdio>

int main() {
  const swarmfit::Scene scene = swarmfit::make_room_scene();  // or read_cloud("table.pcd"), or a view of your own memory

  swarmfit::FitOptions options;
  options.model = swarmfit::ModelType::plane;
  options.threshold = 0.01;  // m

  const auto result = swarmfit::fit(scene.cloud.points(), options, [](const swarmfit::Model& plane) {
    const Eigen::Vector3d n = plane.normal();
    std::printf("found (%.3f %.3f %.3f), offset %.3f, after %.1f ms\n", n.x(), n.y(), n.z(), plane.offset(), plane.found_at_ms);
    return swarmfit::Verdict::go_on;  // or stop: what there is by then is valid
  });
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  std::printf("%s\n", result->brief().c_str());
  return result->models.empty() ? 1 : 0;
}
