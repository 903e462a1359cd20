// Dense stereo: a rectified pair to a disparity map.
#pragma once

#include <opencv2/core.hpp>

namespace swarmfit::io {

/// Disparities d of the left image [px], CV_32F, NaN where not known: left (u, v) is seen at right (u - d, v), 0 <= d < `disparities`.
/// left, right: CV_8UC3, RGB, of one size.
cv::Mat disparity_map(const cv::Mat& left, const cv::Mat& right, int disparities);

}  // namespace swarmfit::io
