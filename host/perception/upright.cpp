#include "host/perception/upright.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

namespace swarmfit::perception {
namespace {

constexpr double kShortest = 20;       // [px] shorter edges do not tell their direction
constexpr double kParallel = 0.035;    // sine of 2 degrees
constexpr int kLooks = 64;             // about so many pixels a row tell the camera's geometry
constexpr double kOffPinhole = 0.002;  // rms on the plane one unit away; more is no pinhole camera

/// From pixels to the plane one unit before the camera: p / p.z = map * (u, v, 1).
using ImageMap = Eigen::Matrix<double, 2, 3>;

std::optional<ImageMap> fit_pinhole(const PointGrid& grid) {
  Eigen::Matrix3d pixels = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> joint = Eigen::Matrix<double, 3, 2>::Zero();
  double square = 0, count = 0;
  const int step = std::max(1, grid.width / kLooks);
  for (int v = 0; v < grid.height; v += step)
    for (int u = 0; u < grid.width; u += step) {
      const auto& p = grid.points[static_cast<std::size_t>(v) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(u)];
      if (!PointGrid::seen(p) || p.z() == 0) continue;
      const Eigen::Vector3d pixel(u, v, 1);
      const Eigen::Vector2d at = (p.head<2>() / p.z()).cast<double>();
      pixels += pixel * pixel.transpose();
      joint += pixel * at.transpose();
      square += at.squaredNorm();
      ++count;
    }
  if (count < kLooks) return std::nullopt;
  const Eigen::Matrix<double, 3, 2> map = pixels.ldlt().solve(joint);
  const double off = (square - map.cwiseProduct(joint).sum()) / count;
  if (!(off < kOffPinhole * kOffPinhole)) return std::nullopt;
  return map.transpose();
}

cv::Mat grey_picture(const Cloud& frame) {
  cv::Mat grey;
  const cv::Mat colour(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));  // only read
  cv::cvtColor(colour, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

}  // namespace

double ImageEdges::share_along(const Eigen::Vector3d& direction) const {
  double sum = 0;
  for (const Edge& edge : list) {
    // From the edge's middle towards the vanishing point.
    const Eigen::Vector2d towards = direction.head<2>() - edge.middle * direction.z();
    const double across = towards.x() * edge.along.y() - towards.y() * edge.along.x();
    if (across * across < kParallel * kParallel * towards.squaredNorm()) sum += edge.length;
  }
  return length > 0 ? sum / length : 0;
}

ImageEdges find_edges(const Cloud& frame, const PointGrid& grid) {
  ImageEdges edges;
  if (!grid.organised() || !frame.coloured()) return edges;
  const auto map = fit_pinhole(grid);
  if (!map) return edges;
  std::vector<cv::Vec4f> found;
  cv::createLineSegmentDetector()->detect(grey_picture(frame), found);
  for (const auto& ends : found) {
    const Eigen::Vector2d a(ends[0], ends[1]), b(ends[2], ends[3]);
    const double length = (b - a).norm();
    if (length < kShortest) continue;
    const Eigen::Vector2d at_a = *map * a.homogeneous(), at_b = *map * b.homogeneous();
    edges.list.push_back({(at_a + at_b) / 2, (at_b - at_a).normalized(), length});
    edges.length += length;
  }
  return edges;
}

}  // namespace swarmfit::perception
