#include "host/io/rectify.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace swarmfit::io {
namespace {

constexpr int kBlock = 15;       // [px] of the first match, along the row
constexpr int kTexture = 10;     // least of a block that is matched
constexpr int kUniqueness = 10;  // the best is better than the second by this [%]
constexpr int kCorners = 4000;   // at most
constexpr double kCornerQuality = 0.005;
constexpr double kCornerSpacing = 4;                    // [px]
constexpr int kWindow = 11;                             // [px] of the second match, both ways
constexpr float kMostAlong = 1.5f, kMostAcross = 2.0f;  // [px] a corner that moves farther from its first match is mistaken
constexpr Eigen::Index kFewCorners = 100;
constexpr int kRounds = 30;        // of reweighting
constexpr double kSoftest = 0.05;  // [px] a residual below has the weight of this one
constexpr double kNoticed = 0.05;  // [px]

struct Matches {
  std::vector<cv::Point2f> at;  // in the right image
  std::vector<float> shift;     // down from the left image's row
};

Matches match_corners(const cv::Mat& left, const cv::Mat& right, int disparities) {
  const auto matcher = cv::StereoBM::create((disparities + 15) / 16 * 16, kBlock);
  matcher->setTextureThreshold(kTexture);
  matcher->setUniquenessRatio(kUniqueness);
  cv::Mat along;  // [1/16 px]
  matcher->compute(left, right, along);
  std::vector<cv::Point2f> corners, first, second;
  cv::goodFeaturesToTrack(left, corners, kCorners, kCornerQuality, kCornerSpacing, along >= 0);
  if (corners.empty()) return {};
  for (const auto& corner : corners) {
    const auto disparity =
        static_cast<float>(along.at<std::int16_t>(cv::Point(corner))) / static_cast<float>(cv::StereoMatcher::DISP_SCALE);
    first.emplace_back(corner.x - disparity, corner.y);
  }
  second = first;
  std::vector<std::uint8_t> found;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(left, right, corners, second, found, error, {kWindow, kWindow}, 0,
                           {cv::TermCriteria::MAX_ITER | cv::TermCriteria::EPS, 20, 0.01}, cv::OPTFLOW_USE_INITIAL_FLOW);
  Matches matches;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::Point2f moved = second[i] - first[i];
    if (found[i] == 0 || !(std::abs(moved.x) < kMostAlong) || !(std::abs(moved.y) < kMostAcross)) continue;
    matches.at.push_back(second[i]);
    matches.shift.push_back(moved.y);
  }
  return matches;
}

/// 1, x and y of the fit.
Eigen::Vector3d terms(double u, double v, const cv::Size& size) {
  return {1, (u - 0.5 * size.width) / size.width, (v - 0.5 * size.height) / size.width};
}

}  // namespace

std::optional<Eigen::Vector3d> row_shift(const cv::Mat& left, const cv::Mat& right, int disparities) {
  if (std::min(left.rows, left.cols) <= kBlock) return std::nullopt;
  const Matches matches = match_corners(left, right, disparities);
  const auto count = static_cast<Eigen::Index>(matches.shift.size());
  if (count < kFewCorners) return std::nullopt;
  Eigen::Matrix3Xd at(3, count);
  for (Eigen::Index i = 0; i < count; ++i)
    at.col(i) = terms(matches.at[static_cast<std::size_t>(i)].x, matches.at[static_cast<std::size_t>(i)].y, right.size());
  const Eigen::VectorXd shift = Eigen::Map<const Eigen::VectorXf>(matches.shift.data(), count).cast<double>();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(count);
  Eigen::Vector3d fit = Eigen::Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Matrix3Xd weighted = at * weight.asDiagonal();
    fit = (weighted * at.transpose()).ldlt().solve(weighted * shift);
    weight = (shift - at.transpose() * fit).cwiseAbs().cwiseMax(kSoftest).cwiseInverse();
  }
  if (!fit.allFinite()) return std::nullopt;
  return fit;
}

cv::Mat level_rows(const cv::Mat& left, const cv::Mat& right, int disparities) {
  cv::Mat grey_left, grey_right;
  cv::cvtColor(left, grey_left, cv::COLOR_RGB2GRAY);
  cv::cvtColor(right, grey_right, cv::COLOR_RGB2GRAY);
  const auto shift = row_shift(grey_left, grey_right, disparities);
  if (!shift) return right;
  const auto at = [&](double u, double v) { return shift->dot(terms(u, v, right.size())); };
  const double width = right.cols, height = right.rows;
  const double most = std::max({std::abs(at(0, 0)), std::abs(at(width, 0)), std::abs(at(0, height)), std::abs(at(width, height))});
  // A shift beyond what corners may move can only be read off a few mistaken ones, at one side.
  if (most < kNoticed || most > static_cast<double>(kMostAcross)) return right;
  cv::Mat map(right.size(), CV_32FC2), level;
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u) map.at<cv::Vec2f>(v, u) = {static_cast<float>(u), static_cast<float>(v + at(u, v))};
  cv::remap(right, level, map, {}, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return level;
}

}  // namespace swarmfit::io
