// What is left of a vertical shift between the images of a rectified pair.
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace swarmfit::io {

/// How much lower the right image shows what the left shows at the same row [px]: a + b x + c y, where (x, y) are the right image's
/// pixels from its middle [image widths]. Least absolute deviations over corners that were matched first along the row and then both
/// ways (Lucas and Kanade 1981). Nothing where fewer than 100 corners are matched. left, right: CV_8UC1 of one size, disparities within
/// [0, `disparities`).
std::optional<Eigen::Vector3d> row_shift(const cv::Mat& left, const cv::Mat& right, int disparities);

/// The right image with its rows brought to the left's; itself where the shift is below what matching notices. left, right: CV_8UC3, RGB,
/// of one size.
cv::Mat level_rows(const cv::Mat& left, const cv::Mat& right, int disparities);

}  // namespace swarmfit::io
