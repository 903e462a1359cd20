// Take each line the moment it is found, and stop when there are enough.
#include <swarmfit/swarmfit.hpp>

#include <cmath>
#include <cstdio>
#include <random>

int main() {
  // Five lines across a 100 x 100 picture, 200 points each, and 200 points of clutter.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(0, 100);
  std::normal_distribution<double> noise(0, 0.2);
  Eigen::Matrix2Xd points(2, 1200);
  for (int i = 0; i < 1200; ++i) {
    const int line = i / 200;
    const double x = anywhere(random);
    points.col(i) = line < 5 ? Eigen::Vector2d(x, 10 + 20 * line + noise(random)) : Eigen::Vector2d(x, anywhere(random));
  }

  swarmfit::FitOptions options;
  options.model = swarmfit::ModelType::line2d;
  options.threshold = 1;
  std::size_t told = 0;
  const auto result = swarmfit::fit(swarmfit::PointsView(points), options, [&](const swarmfit::Model& line) {
    ++told;
    std::printf("line %zu after %.1f ms: %.3f x %+.3f y %+.2f = 0, %zu points\n", told, line.found_at_ms, line.parameters[0],
                line.parameters[1], line.offset(), line.inliers);
    return told == 2 ? swarmfit::Verdict::stop : swarmfit::Verdict::go_on;
  });
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return 1;
  }
  std::printf("%zu lines; %s\n", result->models.size(), result->stop_reason.c_str());

  // What there is at the stop is valid: each is one of the five, y = 10, 30, 50, 70 or 90, and every point has its label.
  bool right = told == 2 && result->models.size() == 2 && result->labels.size() == 1200;
  for (const swarmfit::Model& line : result->models) {
    const double y = -line.offset() / line.parameters[1];
    right = right && std::abs(line.parameters[1]) > 0.999 && std::abs(std::remainder(y - 10, 20)) < 0.5;
  }
  return right ? 0 : 1;
}
