#include "host/figures/line_scene.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace swarmfit::figures {
namespace {

/// The same numbers on every standard library.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : engine_(seed) {}
  /// Uniform in [0, 1).
  double operator()() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  /// Box and Muller: standard normal.
  double bell() { return std::sqrt(-2 * std::log(1 - (*this)())) * std::cos(2 * std::numbers::pi * (*this)()); }
  Eigen::Vector2d place() {
    const double x = (*this)();
    return {x, (*this)()};
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace

LineScene make_line_scene(std::vector<Segment> truth, std::uint64_t seed) {
  Numbers number(seed);
  LineScene scene{std::move(truth), {}};
  for (const Segment& s : scene.truth) {
    const Eigen::Vector2d along = s.b - s.a, across = Eigen::Vector2d(-along.y(), along.x()).normalized();
    for (std::size_t i = 0; i < kOnLine; ++i) {
      const double t = number();
      scene.points.emplace_back(s.a + t * along + kNoise * number.bell() * across);
    }
  }
  for (std::size_t i = 0; i < kOutliers; ++i) scene.points.push_back(number.place());
  return scene;
}

std::vector<Segment> random_segments(std::size_t count, std::uint64_t seed) {
  constexpr double kShortest = 0.5;
  Numbers number(seed ^ 0x5eedU);
  std::vector<Segment> segments;
  while (segments.size() < count) {
    const Eigen::Vector2d a = number.place(), b = number.place();
    if ((b - a).norm() >= kShortest) segments.push_back({a, b});
  }
  return segments;
}

}  // namespace swarmfit::figures
