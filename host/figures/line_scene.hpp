// The paper's line experiment: 100 points on each line, 700 anywhere in the unit square.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <swarmfit/points.hpp>

namespace swarmfit::figures {

inline constexpr std::size_t kOnLine = 100, kOutliers = 700;
inline constexpr double kNoise = 0.005;             ///< standard deviation across a line; the square's side is 1
inline constexpr double kThreshold = 2.5 * kNoise;  ///< tau

struct Segment {
  Eigen::Vector2d a, b;
};

struct LineScene {
  std::vector<Segment> truth;
  std::vector<Eigen::Vector2d> points;  ///< kOnLine of each segment in turn, then the outliers

  PointsView view() const { return {points.data(), PointsView::Scalar::float64, 2, points.size(), sizeof(Eigen::Vector2d)}; }
};

LineScene make_line_scene(std::vector<Segment> truth, std::uint64_t seed);
/// Segments between uniform points at least half a side apart.
std::vector<Segment> random_segments(std::size_t count, std::uint64_t seed);

}  // namespace swarmfit::figures
