#include "host/perception/recognition_match.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <opencv2/features2d.hpp>

namespace swarmfit::perception {
namespace {

constexpr double kContrast = 0.015;       // half of SIFT's usual: things are small and indoor light is soft
constexpr float kRatio = 0.82f;           // of the nearest and the second nearest distance
constexpr double kElsewhere = 4;          // [px] nearer than this the second nearest is the same corner again
constexpr double kScaleRange = 2;         // scales of a match and of the placement agree within this factor
constexpr double kAngleRange = 35;        // [deg] and their directions within this
constexpr double kRoughTolerance = 0.12;  // of the view's size as placed: position under a similarity
constexpr double kFineTolerance = 0.04;   // and under the refined map
constexpr std::size_t kHomographyPoints = 10;

Eigen::Vector2d at(const cv::KeyPoint& point) { return {point.pt.x, point.pt.y}; }

Eigen::Vector2d apply(const Eigen::Matrix3d& map, const Eigen::Vector2d& x) { return (map * x.homogeneous()).hnormalized(); }

double degrees_between(double a, double b) {
  const double d = std::abs(std::remainder(a - b, 360.0));
  return d;
}

/// Similarity that carries the view's keypoint, with its size and direction, onto the seen one.
Eigen::Matrix3d similarity(const cv::KeyPoint& view, const cv::KeyPoint& seen) {
  const double scale = seen.size / view.size, turn = (seen.angle - view.angle) * (3.14159265358979323846 / 180);
  Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
  map(0, 0) = map(1, 1) = scale * std::cos(turn);
  map(1, 0) = scale * std::sin(turn);
  map(0, 1) = -map(1, 0);
  map.topRightCorner<2, 1>() = at(seen) - map.topLeftCorner<2, 2>() * at(view);
  return map;
}

/// Linear part of the map at a point, by differences.
Eigen::Matrix2d derivative(const Eigen::Matrix3d& map, const Eigen::Vector2d& x) {
  Eigen::Matrix2d d;
  d.col(0) = apply(map, x + Eigen::Vector2d(0.5, 0)) - apply(map, x - Eigen::Vector2d(0.5, 0));
  d.col(1) = apply(map, x + Eigen::Vector2d(0, 0.5)) - apply(map, x - Eigen::Vector2d(0, 0.5));
  return d;
}

/// The view's outline stays an outline: same sense, convex, neither tiny nor huge, not squeezed flat.
bool sane(const Eigen::Matrix3d& map, const cv::Size& size) {
  if (!map.allFinite()) return false;
  const Eigen::Vector2d corner[4] = {{0, 0}, {size.width, 0}, {size.width, size.height}, {0, size.height}};
  Eigen::Vector2d to[4];
  for (int i = 0; i < 4; ++i) {
    if ((map * corner[i].homogeneous()).z() <= 1e-6) return false;
    to[i] = apply(map, corner[i]);
    const Eigen::JacobiSVD<Eigen::Matrix2d> svd(derivative(map, corner[i]));
    const double large = svd.singularValues()[0], small = svd.singularValues()[1];
    if (large > 20 || small < 0.02 || large > 5 * small) return false;
  }
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = to[(i + 1) % 4] - to[i], b = to[(i + 2) % 4] - to[(i + 1) % 4];
    if (a.x() * b.y() - a.y() * b.x() <= 0) return false;
  }
  return true;
}

/// Matches that the map explains: position, and scale and direction of the keypoints. No view or seen point is counted twice.
std::vector<Match> agreeing(const Eigen::Matrix3d& map, const Features& view, const Features& seen, std::span<const Match> matches,
                            double tolerance) {
  const Eigen::Matrix2d middle = derivative(map, {view.size.width / 2.0, view.size.height / 2.0});
  const double scale = std::sqrt(std::abs(middle.determinant()));
  const double reach = std::max(2.5, tolerance * scale * std::sqrt(static_cast<double>(view.size.area())));
  std::vector<std::pair<double, Match>> close;
  for (const Match& match : matches) {
    const cv::KeyPoint &from = view.points[static_cast<std::size_t>(match.view)], &to = seen.points[static_cast<std::size_t>(match.seen)];
    const double error = (apply(map, at(from)) - at(to)).norm();
    if (!(error < reach)) continue;
    const Eigen::Matrix2d local = derivative(map, at(from));
    const double size = to.size / (from.size * std::sqrt(std::abs(local.determinant())));
    if (size > kScaleRange || size * kScaleRange < 1) continue;
    const double turn = std::atan2(local(1, 0) - local(0, 1), local(0, 0) + local(1, 1)) * (180 / 3.14159265358979323846);
    if (degrees_between(to.angle - from.angle, turn) > kAngleRange) continue;
    close.emplace_back(error, match);
  }
  std::stable_sort(close.begin(), close.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Match> kept;
  for (const auto& [error, match] : close) {
    const bool again = std::any_of(kept.begin(), kept.end(), [&](const Match& k) {
      return (at(view.points[static_cast<std::size_t>(k.view)]) - at(view.points[static_cast<std::size_t>(match.view)])).norm() < 1.5 ||
             (at(seen.points[static_cast<std::size_t>(k.seen)]) - at(seen.points[static_cast<std::size_t>(match.seen)])).norm() < 1.5;
    });
    if (!again) kept.push_back(match);
  }
  return kept;
}

std::optional<Eigen::Matrix3d> fit_affine(const Features& view, const Features& seen, std::span<const Match> matches) {
  if (matches.size() < 4) return std::nullopt;
  Eigen::MatrixX3d from(static_cast<Eigen::Index>(matches.size()), 3);
  Eigen::MatrixX2d to(static_cast<Eigen::Index>(matches.size()), 2);
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    const Match& match = matches[static_cast<std::size_t>(i)];
    from.row(i) = at(view.points[static_cast<std::size_t>(match.view)]).homogeneous().transpose();
    to.row(i) = at(seen.points[static_cast<std::size_t>(match.seen)]).transpose();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixX3d> qr(from);
  if (qr.rank() < 3) return std::nullopt;
  Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
  map.topRows<2>() = qr.solve(to).transpose();
  return map;
}

/// Direct linear transform with both sides centred and scaled.
std::optional<Eigen::Matrix3d> fit_homography(const Features& view, const Features& seen, std::span<const Match> matches) {
  if (matches.size() < kHomographyPoints) return std::nullopt;
  const auto normaliser = [&](const auto& point_of) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Match& m : matches) mean += point_of(m) / static_cast<double>(matches.size());
    double spread = 0;
    for (const Match& m : matches) spread += (point_of(m) - mean).norm() / static_cast<double>(matches.size());
    Eigen::Matrix3d map = Eigen::Matrix3d::Identity() * (1 / std::max(spread, 1e-9));
    map.topRightCorner<2, 1>() = -map(0, 0) * mean;
    map(2, 2) = 1;
    return map;
  };
  const auto in_view = [&](const Match& m) { return at(view.points[static_cast<std::size_t>(m.view)]); };
  const auto in_frame = [&](const Match& m) { return at(seen.points[static_cast<std::size_t>(m.seen)]); };
  const Eigen::Matrix3d from = normaliser(in_view), to = normaliser(in_frame);
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const Match& m : matches) {
    const Eigen::Vector3d x = from * in_view(m).homogeneous();
    const Eigen::Vector2d y = (to * in_frame(m).homogeneous()).hnormalized();
    Eigen::Matrix<double, 2, 9> row;
    row << x.transpose(), 0, 0, 0, -y.x() * x.transpose(), 0, 0, 0, x.transpose(), -y.y() * x.transpose();
    normal += row.transpose() * row;
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(normal, Eigen::ComputeFullV);
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Eigen::Matrix3d map;
  map << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  map = to.inverse() * map * from;
  if (std::abs(map(2, 2)) < 1e-12) return std::nullopt;
  return Eigen::Matrix3d(map / map(2, 2));
}

}  // namespace

Features find_features(const cv::Mat1b& grey, const cv::Mat1b& mask) {
  Features features;
  features.size = grey.size();
  if (grey.rows < 16 || grey.cols < 16) return features;
  cv::Mat descriptors;
  cv::SIFT::create(0, 3, kContrast, 10, 1.6)->detectAndCompute(grey, mask, features.points, descriptors);
  features.descriptors = descriptors;
  // RootSIFT: Hellinger's distance between the histograms, as Euclid's between their roots.
  for (int i = 0; i < features.descriptors.rows; ++i) {
    cv::Mat1f row = features.descriptors.row(i);
    const double sum = cv::norm(row, cv::NORM_L1);
    for (float& value : row) value = static_cast<float>(std::sqrt(value / std::max(sum, 1e-9)));
  }
  return features;
}

std::vector<Match> match_features(const Features& view, const Features& seen) {
  std::vector<Match> matches;
  if (view.points.size() < 2 || seen.points.empty()) return matches;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_L2).knnMatch(seen.descriptors, view.descriptors, nearest, 4);
  for (const auto& found : nearest) {
    const auto place = [&](const cv::DMatch& m) { return at(view.points[static_cast<std::size_t>(m.trainIdx)]); };
    // SIFT gives one corner several directions and scales: the second nearest must be another corner.
    const auto second =
        std::find_if(found.begin() + 1, found.end(), [&](const cv::DMatch& m) { return (place(m) - place(found[0])).norm() > kElsewhere; });
    const float rival = second != found.end() ? second->distance : found.back().distance;
    if (found[0].distance < kRatio * rival) matches.push_back({found[0].trainIdx, found[0].queryIdx});
  }
  return matches;
}

Placement place_view(const Features& view, const Features& seen, std::span<const Match> matches, std::size_t least) {
  Placement best;
  for (const Match& match : matches) {
    const Eigen::Matrix3d map =
        similarity(view.points[static_cast<std::size_t>(match.view)], seen.points[static_cast<std::size_t>(match.seen)]);
    if (!sane(map, view.size)) continue;
    auto inliers = agreeing(map, view, seen, matches, kRoughTolerance);
    if (inliers.size() > best.inliers.size()) best = {map, std::move(inliers)};
  }
  if (best.inliers.size() < least) return {};
  Placement refined = {best.view_to_frame, {}};
  for (int round = 0; round < 4; ++round) {
    const auto& from = round == 0 ? best.inliers : refined.inliers;
    // A homography bends: it may only replace an affine map that it clearly beats.
    for (const auto& map : {fit_affine(view, seen, from), fit_homography(view, seen, from)}) {
      if (!map || !sane(*map, view.size)) continue;
      auto inliers = agreeing(*map, view, seen, matches, kFineTolerance);
      if (inliers.size() > refined.inliers.size()) refined = {*map, std::move(inliers)};
    }
    if (refined.inliers.size() < least) return {};
  }
  return refined;
}

}  // namespace swarmfit::perception
