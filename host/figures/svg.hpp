// As much of SVG as a plot needs.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace swarmfit::figures {

/// Pixels, x to the right and y down.
using Place = Eigen::Vector2d;

struct Stroke {
  std::string colour = "#111827";
  double width = 1;
  double opacity = 1;
  std::string dashes;  ///< "4 3"; empty: unbroken
};

struct Lettering {
  double size = 12;
  std::string_view anchor = "start";  ///< start, middle, end
  std::string colour = "#374151";
  bool bold = false;
  bool upright = false;  ///< turned by 90 degrees, for the axis on the left
};

class Svg {
 public:
  Svg(int width, int height);

  void rectangle(const Place& corner, double width, double height, const std::string& fill, const std::string& border = "none");
  void line(const Place& a, const Place& b, const Stroke& stroke);
  void polyline(std::span<const Place> places, const Stroke& stroke);
  /// Round dots, all in one element.
  void dots(std::span<const Place> places, double diameter, const std::string& colour, double opacity = 1);
  void text(const Place& at, std::string_view words, const Lettering& lettering = {});
  /// The whole file.
  std::string finish() &&;

 private:
  std::string out_;
};

}  // namespace swarmfit::figures
