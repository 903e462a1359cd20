#include <swarmfit/swarmfit.hpp>

#include <iostream>

int main(int, char** argv) {
  const auto cloud = swarmfit::read_cloud(argv[1]);
  if (!cloud) return std::cerr << cloud.error().message << "\n", 1;
  const auto result = swarmfit::fit(cloud->points(), {.model = swarmfit::ModelType::plane, .threshold = 0.02});
  if (!result) return std::cerr << result.error().message << "\n", 1;
  for (const auto& plane : result->models) {
    std::cout << plane.normal().transpose() << "  " << plane.offset() << "  " << plane.inliers << " points\n";
  }
}
