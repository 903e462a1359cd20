// How probable it is that a pixel lies on the border of a thing, as far as the picture tells.
#pragma once

#include <opencv2/core.hpp>

#include <swarmfit/cloud.hpp>

namespace swarmfit::perception {

/// Gradients of colour and of texture between the two sides of each pixel, along both axes, taken together as two independent witnesses:
/// 1 - (1 - P_colour)(1 - P_texture), in [0, 1]. At the image's size; `frame` is organised and coloured.
cv::Mat1f boundary_probability(const Cloud& frame);

}  // namespace swarmfit::perception
