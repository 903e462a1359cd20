#include "host/io/ground_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::io {

cv::Mat ground_image(const Cloud& input) {
  cv::Mat image(input.height, input.width, CV_8UC3, cv::Scalar::all(30));
  if (input.coloured()) {
    std::copy(input.rgb.begin(), input.rgb.end(), image.data);
    return image;
  }
  const auto depth = [&](std::size_t i) {
    return input.values64.empty() ? static_cast<double>(input.values32[3 * i + 2]) : input.values64[3 * i + 2];
  };
  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (!std::isfinite(depth(i))) continue;
    nearest = std::min(nearest, depth(i));
    farthest = std::max(farthest, depth(i));
  }
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (!std::isfinite(depth(i))) continue;
    const double share = farthest > nearest ? (depth(i) - nearest) / (farthest - nearest) : 0;
    std::fill_n(image.data + 3 * i, 3, static_cast<std::uint8_t>(220 - 160 * share));
  }
  return image;
}

}  // namespace swarmfit::io
