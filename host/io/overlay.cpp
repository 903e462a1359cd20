// overlay.png: the whole result at a glance.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <fmt/format.h>

#include <swarmfit/results.hpp>

#include "host/io/ground_image.hpp"
#include "host/io/palette.hpp"

namespace swarmfit {
namespace {

cv::Scalar scalar(const io::Rgb& colour) { return {double(colour[0]), double(colour[1]), double(colour[2])}; }

/// Lines, text and margins grow with the image.
double scale_of(const cv::Mat& image) { return std::clamp(image.cols / 640.0, 0.4, 3.0); }
int stroke(const cv::Mat& image, double width) { return std::max(1, static_cast<int>(std::lround(width * scale_of(image)))); }

void blend(std::uint8_t* pixel, const io::Rgb& colour, double share) {
  for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] * (1 - share) + colour[c] * share));
}

/// Supporting planes in full colour, others faint, what sticks out of them yellow.
void tint(cv::Mat& image, const PerceiveResult& result) {
  const auto& models = result.fit.models;
  for (std::size_t i = 0; i < image.total(); ++i) {
    const std::size_t plane = i < result.fit.labels.size() ? result.fit.labels[i] : 0;
    if (i < result.popout.size() && result.popout[i] != 0) {
      blend(image.data + 3 * i, io::kStickingOut, 0.5);
    } else if (plane != 0 && plane <= models.size()) {
      blend(image.data + 3 * i, io::plane_colour(plane), models[plane - 1].supporting ? 0.55 : 0.22);
    }
  }
}

/// The border of each proto-object, white on black so that it shows on anything.
void draw_outlines(cv::Mat& image, const PerceiveResult& result) {
  if (result.objects.size() != image.total()) return;
  const cv::Mat objects(image.rows, image.cols, CV_16U, const_cast<std::uint16_t*>(result.objects.data()));
  for (std::size_t k = 1; k <= result.sois.size(); ++k) {
    std::vector<std::vector<cv::Point>> contours;
    cv::Mat mask = objects == static_cast<double>(k);
    cv::findContours(mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    cv::drawContours(image, contours, -1, cv::Scalar::all(0), stroke(image, 3));
    cv::drawContours(image, contours, -1, cv::Scalar::all(255), stroke(image, 1.4));
  }
}

/// Text on a dark box whose lower left corner is near `at`, kept within the image. Gives the box.
cv::Rect draw_text(cv::Mat& image, const std::string& text, cv::Point at, const cv::Scalar& colour, double relative_size = 1) {
  const double size = 0.45 * relative_size * scale_of(image);
  int below = 0;
  const cv::Size extent = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, stroke(image, 1), &below);
  const int pad = stroke(image, 3 * relative_size);
  cv::Rect box(at.x, at.y - extent.height - below - 2 * pad, extent.width + 2 * pad, extent.height + below + 2 * pad);
  box.x = std::clamp(box.x, 0, std::max(0, image.cols - box.width));
  box.y = std::clamp(box.y, 0, std::max(0, image.rows - box.height));
  cv::rectangle(image, box, cv::Scalar::all(20), cv::FILLED);
  cv::putText(image, text, {box.x + pad, box.y + pad + extent.height}, cv::FONT_HERSHEY_SIMPLEX, size, colour, stroke(image, 1),
              cv::LINE_AA);
  return box;
}

/// OpenCV's font knows ASCII alone.
std::string printable(std::string text) {
  std::erase_if(text, [](char c) { return static_cast<unsigned char>(c) >= 0x80 && static_cast<unsigned char>(c) < 0xC0; });
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80 || c < 0x20; }, '?');
  return text;
}

void draw_sois(cv::Mat& image, const PerceiveResult& result) {
  for (const auto& soi : result.sois) {
    const auto& [x, y, width, height] = soi.bbox;
    if (width > 0 && height > 0) cv::rectangle(image, {x, y, width, height}, cv::Scalar(0, 230, 255), stroke(image, 1));
  }
  constexpr std::size_t kCrowd = 20;
  const double size = result.sois.size() > kCrowd ? 0.7 : 1;
  for (std::size_t k = 0; k < result.sois.size(); ++k) {  // names last, so that no rectangle crosses one
    const auto& soi = result.sois[k];
    if (soi.bbox[2] <= 0 || soi.bbox[3] <= 0) continue;
    const std::string name = soi.recognised.empty() ? "" : " " + printable(soi.recognised.front().name);
    draw_text(image, std::to_string(k + 1) + name, {soi.bbox[0], soi.bbox[1]},
              name.empty() ? cv::Scalar::all(255) : cv::Scalar(160, 255, 160), size);
  }
}

void draw_legend(cv::Mat& image, const PerceiveResult& result) {
  constexpr std::size_t kMostLines = 8;
  std::vector<std::pair<std::string, io::Rgb>> lines;
  std::size_t left_out = 0;
  for (std::size_t k = 1; k <= result.fit.models.size(); ++k) {
    if (!result.fit.models[k - 1].supporting) continue;
    if (lines.size() < kMostLines) {
      lines.emplace_back(fmt::format("plane {} supports", k), io::plane_colour(k));
    } else {
      ++left_out;
    }
  }
  if (left_out) lines.emplace_back(fmt::format("{} more support", left_out), io::kUnlabelled);
  if (!result.sois.empty()) lines.emplace_back(fmt::format("sticks out: {}", result.sois.size()), io::kStickingOut);
  int y = image.rows - stroke(image, 4);
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    const int swatch = stroke(image, 12);
    const cv::Rect box = draw_text(image, line->first, {stroke(image, 8) + swatch, y}, cv::Scalar::all(255), 0.8);
    cv::rectangle(image, cv::Rect(stroke(image, 4), box.y, swatch, box.height) & cv::Rect({}, image.size()), scalar(line->second),
                  cv::FILLED);
    y = box.y - 1;
  }
}

}  // namespace

std::vector<std::uint8_t> render_overlay(const PerceiveResult& result, const Cloud& input) {
  cv::Mat image = io::ground_image(input);
  tint(image, result);
  draw_outlines(image, result);
  draw_sois(image, result);
  draw_legend(image, result);
  return {image.datastart, image.dataend};
}

}  // namespace swarmfit
