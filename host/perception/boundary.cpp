#include "host/perception/boundary.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace swarmfit::perception {
namespace {

// A gradient of this size is a border with probability 1 - 1/e. Chosen on labelled Kinect frames.
constexpr float kColourScale = 14;  // in Lab [0, 100], between means of 3 x 2 pixels
constexpr float kTextureScale = 6;  // of the mean slope of lightness, between means of 9 x 4 pixels
constexpr float kInhibition = 1.5;  // of colour by the mean slope around
constexpr int kSurroundings = 15;   // [px]

/// The difference between the means of `across` x `along` pixels on either side, summed squared over both axes.
void add_squared_gradient(const cv::Mat1f& channel, int along, int across, cv::Mat1f& sum) {
  cv::Mat1f side(1, 2 * along + 1), mean = cv::Mat1f::ones(1, across) / static_cast<float>(across);
  for (int i = 0; i < side.cols; ++i) side(0, i) = static_cast<float>((i > along) - (i < along)) / static_cast<float>(along);
  for (const bool upright : {false, true}) {
    cv::Mat1f gradient;
    cv::sepFilter2D(channel, gradient, CV_32F, upright ? mean : side, upright ? side : mean, {-1, -1}, 0, cv::BORDER_REPLICATE);
    cv::accumulateSquare(gradient, sum);
  }
}

/// Lab, each component about as wide as [0, 100].
std::array<cv::Mat1f, 3> to_lab(const Cloud& frame) {
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));
  cv::Mat scaled, lab;
  rgb.convertTo(scaled, CV_32F, 1.0 / 255);
  cv::cvtColor(scaled, lab, cv::COLOR_RGB2Lab);
  std::array<cv::Mat1f, 3> channels;
  cv::split(lab, channels.data());
  return channels;
}

}  // namespace

cv::Mat1f boundary_probability(const Cloud& frame) {
  const auto lab = to_lab(frame);
  cv::Mat1f colour(frame.height, frame.width, 0.0f), texture = colour.clone(), roughness = colour.clone();
  for (const cv::Mat1f& channel : lab) add_squared_gradient(channel, 2, 3, colour);
  for (const bool upright : {false, true}) {
    cv::Mat1f slope;
    cv::Sobel(lab[0], slope, CV_32F, upright ? 0 : 1, upright ? 1 : 0, 3, 0.25, 0, cv::BORDER_REPLICATE);
    slope = cv::abs(slope);
    add_squared_gradient(slope, 4, 9, texture);
    roughness += slope;
  }
  cv::boxFilter(roughness, roughness, CV_32F, {kSurroundings, kSurroundings}, {-1, -1}, true, cv::BORDER_REPLICATE);
  // Amid texture a step of colour is nothing unusual.
  const cv::Mat1f usual = kColourScale * kColourScale + kInhibition * kInhibition * roughness.mul(roughness);
  cv::Mat1f unlikely;
  cv::exp(-colour / usual - texture / (kTextureScale * kTextureScale), unlikely);
  return 1 - unlikely;
}

}  // namespace swarmfit::perception
