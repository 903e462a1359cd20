// What an organised cloud looks like before anything is drawn on it.
#pragma once

#include <opencv2/core.hpp>

#include <swarmfit/cloud.hpp>

namespace swarmfit::io {

/// The camera's image, or depth in grey where there is no colour. 8-bit RGB.
cv::Mat ground_image(const Cloud& input);

}  // namespace swarmfit::io
