// From an image grid to an organised cloud.
#pragma once

#include <opencv2/core.hpp>

#include <swarmfit/cloud.hpp>

namespace swarmfit::io {

/// Fails with invalid_option.
Expected<> check_intrinsics(const Intrinsics& intrinsics);
/// z: CV_32F [m], NaN for none.
void back_project(const cv::Mat& z, const Intrinsics& intrinsics, Cloud& cloud);
/// CV_8UC3 of the cloud's size, red first or last.
void take_colours(const cv::Mat& image, bool rgb, Cloud& cloud);

}  // namespace swarmfit::io
