// One pair of axes in a figure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/figures/svg.hpp"

namespace swarmfit::figures {

struct Range {
  double low = 0, high = 1;
  bool holds(double v) const noexcept { return v >= low && v <= high; }
};

struct Axis {
  std::string label;
  Range range;
  std::vector<double> ticks;
};

class Chart {
 public:
  /// Draws frame, ticks and labels at once. `corner` is the frame's upper left.
  Chart(Svg& svg, const Place& corner, double width, double height, Axis x, Axis y, const std::string& title);

  Place at(double x, double y) const;
  bool holds(double x, double y) const noexcept { return x_.range.holds(x) && y_.range.holds(y); }
  /// The part of a x + b y + c = 0 that is within the frame.
  void straight(double a, double b, double c, const Stroke& stroke);
  Svg& svg() noexcept { return svg_; }

 private:
  Svg& svg_;
  Place corner_;
  double width_, height_;
  Axis x_, y_;
};

/// Pale to dark for 0 to 1.
std::string shade(double share);

}  // namespace swarmfit::figures
