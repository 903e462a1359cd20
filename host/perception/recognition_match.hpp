// Features of two pictures, which belong together, and whether they agree on where the one lies in the other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace swarmfit::perception {

/// SIFT keypoints with RootSIFT descriptors, one a row.
struct Features {
  std::vector<cv::KeyPoint> points;
  cv::Mat1f descriptors;
  cv::Size size;  ///< of the picture [px]
};

/// Only where the mask is not 0; an empty mask is everywhere.
Features find_features(const cv::Mat1b& grey, const cv::Mat1b& mask);

/// `view` is a row in the view's features, `seen` one in the frame's.
struct Match {
  int view = 0, seen = 0;
};

/// Each seen feature to the nearest of the view, where the second nearest elsewhere is clearly farther (Lowe's ratio test).
std::vector<Match> match_features(const Features& view, const Features& seen);

/// A view found: which matches agree, and where its corners come to lie.
struct Placement {
  Eigen::Matrix3d view_to_frame = Eigen::Matrix3d::Identity();
  std::vector<Match> inliers;  ///< no view point and no seen point twice
};

/// The placement most matches agree with: each match proposes a similarity by its position, scale and direction; the best is refined to an
/// affine map and, where enough agree, a homography. Empty inliers: none that is sane has at least `least`. No randomness.
Placement place_view(const Features& view, const Features& seen, std::span<const Match> matches, std::size_t least);

}  // namespace swarmfit::perception
