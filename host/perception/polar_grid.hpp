// A log-polar grid about a point of the image, closed in angle: rings grow by the same factor, cells are about as wide as long.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "host/common/min_cut.hpp"

namespace swarmfit::perception {

class PolarGrid {
 public:
  static constexpr double kLeastRadius = 1.5;  ///< [px]

  /// Covers `rect`, which holds `fixation` [px], beyond the `innermost` ring's radius, >= kLeastRadius. About as fine as the pixels half
  /// way out, within bounds.
  PolarGrid(cv::Point fixation, cv::Rect rect, double innermost);

  cv::Point fixation() const noexcept { return fixation_; }
  int angles() const noexcept { return angles_; }
  int rings() const noexcept { return rings_; }
  std::int32_t cells() const noexcept { return angles_ * rings_; }
  bool innermost(std::int32_t cell) const noexcept { return cell < angles_; }
  /// The pixel that the cell's middle lies in; it may be outside of the rectangle.
  cv::Point pixel(std::int32_t cell) const noexcept { return pixels_[static_cast<std::size_t>(cell)]; }
  /// The cell that holds the middle of a pixel of the rectangle.
  std::int32_t cell(cv::Point pixel) const noexcept;

  /// Four neighbours a cell, fewer on the first and the last ring.
  common::CutGraph make_graph() const;

 private:
  cv::Point fixation_;
  double innermost_ = kLeastRadius;  ///< [px] outer radius of the first ring
  int angles_ = 0, rings_ = 0;
  double step_ = 0;  ///< [rad] between angles, and of the logarithm of the radius between rings
  std::vector<cv::Point> pixels_;
};

}  // namespace swarmfit::perception
