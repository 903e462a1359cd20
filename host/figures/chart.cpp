#include "host/figures/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace swarmfit::figures {
namespace {

const Stroke kFrame = {"#6b7280", 1, 1, {}};
const Stroke kGrid = {"#e5e7eb", 1, 1, {}};

}  // namespace

Chart::Chart(Svg& svg, const Place& corner, double width, double height, Axis x, Axis y, const std::string& title)
    : svg_(svg), corner_(corner), width_(width), height_(height), x_(std::move(x)), y_(std::move(y)) {
  const double bottom = corner.y() + height, middle = corner.x() + width / 2;
  for (const double tick : x_.ticks) {
    const double px = at(tick, y_.range.low).x();
    svg_.line({px, corner.y()}, {px, bottom}, kGrid);
    svg_.text({px, bottom + 14}, fmt::format("{:.6g}", std::abs(tick) < 1e-12 ? 0.0 : tick), {.size = 11, .anchor = "middle"});
  }
  for (const double tick : y_.ticks) {
    const double py = at(x_.range.low, tick).y();
    svg_.line({corner.x(), py}, {corner.x() + width, py}, kGrid);
    svg_.text({corner.x() - 6, py + 4}, fmt::format("{:.6g}", std::abs(tick) < 1e-12 ? 0.0 : tick), {.size = 11, .anchor = "end"});
  }
  svg_.rectangle(corner, width, height, "none", kFrame.colour);
  if (!x_.label.empty()) svg_.text({middle, bottom + 32}, x_.label, {.anchor = "middle"});
  if (!y_.label.empty()) svg_.text({corner.x() - 56, corner.y() + height / 2}, y_.label, {.anchor = "middle", .upright = true});
  svg_.text({middle, corner.y() - 8}, title, {.size = 13, .anchor = "middle", .colour = "#111827", .bold = true});
}

Place Chart::at(double x, double y) const {
  return {corner_.x() + width_ * (x - x_.range.low) / (x_.range.high - x_.range.low),
          corner_.y() + height_ * (y_.range.high - y) / (y_.range.high - y_.range.low)};
}

void Chart::straight(double a, double b, double c, const Stroke& stroke) {
  // Liang and Barsky: from the foot of the origin, as far either way as both ranges allow.
  const double ox = -a * c, oy = -b * c, dx = -b, dy = a;
  double first = -1e9, last = 1e9;
  for (const auto& [origin, step, range] : {std::tuple{ox, dx, x_.range}, std::tuple{oy, dy, y_.range}}) {
    if (std::abs(step) < 1e-12) {
      if (!range.holds(origin)) return;
      continue;
    }
    const double one = (range.low - origin) / step, other = (range.high - origin) / step;
    first = std::max(first, std::min(one, other));
    last = std::min(last, std::max(one, other));
  }
  if (first >= last) return;
  svg_.line(at(ox + first * dx, oy + first * dy), at(ox + last * dx, oy + last * dy), stroke);
}

std::string shade(double share) {
  static constexpr std::array<std::array<double, 3>, 5> kStops = {
      {{214, 222, 232}, {127, 163, 194}, {232, 163, 61}, {194, 65, 12}, {110, 18, 18}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double t = at - static_cast<double>(k);
  std::array<int, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<int>(std::lround((1 - t) * kStops[k][c] + t * kStops[k + 1][c]));
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

}  // namespace swarmfit::figures
