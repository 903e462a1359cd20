#include "host/perception/polar_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace swarmfit::perception {

PolarGrid::PolarGrid(cv::Point fixation, cv::Rect rect, double innermost)
    : fixation_(fixation), innermost_(std::max(innermost, kLeastRadius)) {
  constexpr int kFewest = 60, kMost = 300;
  constexpr double kFineness = 2.2;  // angles a pixel of the radius
  const double across = std::max(fixation.x - rect.x, rect.br().x - fixation.x),
               down = std::max(fixation.y - rect.y, rect.br().y - fixation.y);
  const double farthest = std::hypot(across, down) + 1;
  angles_ = std::clamp(static_cast<int>(kFineness * farthest), kFewest, kMost);
  step_ = 2 * std::numbers::pi / angles_;
  rings_ = 1 + std::max(1, static_cast<int>(std::ceil(std::log(farthest / innermost_) / step_)));
  pixels_.resize(static_cast<std::size_t>(cells()));
  for (int ring = 0; ring < rings_; ++ring) {
    const double radius = innermost_ * std::exp(step_ * (ring - 0.5));
    for (int angle = 0; angle < angles_; ++angle) {
      const double turn = step_ * (angle + 0.5);
      pixels_[static_cast<std::size_t>(ring * angles_ + angle)] =
          fixation +
          cv::Point(static_cast<int>(std::lround(radius * std::cos(turn))), static_cast<int>(std::lround(radius * std::sin(turn))));
    }
  }
}

std::int32_t PolarGrid::cell(cv::Point pixel) const noexcept {
  const cv::Point2d d = pixel - fixation_;
  const double radius = std::hypot(d.x, d.y);
  const int ring = radius <= innermost_ ? 0 : std::clamp(1 + static_cast<int>(std::log(radius / innermost_) / step_), 1, rings_ - 1);
  const double turn = std::atan2(d.y, d.x);
  const int angle = static_cast<int>((turn < 0 ? turn + 2 * std::numbers::pi : turn) / step_);
  return ring * angles_ + std::min(angle, angles_ - 1);
}

common::CutGraph PolarGrid::make_graph() const {
  using Arc = common::CutGraph::Arc;
  // The arcs of a cell in this order: to the next and the last angle, out, in. The innermost ring has no in, the outermost no out.
  const auto first_of = [&](int ring, int angle) {
    const int before = ring == 0 ? 0 : 4 * ring * angles_ - angles_;
    return before + angle * (ring == 0 || ring == rings_ - 1 ? 3 : 4);
  };
  std::vector<std::int32_t> first;
  std::vector<Arc> arcs;
  first.reserve(pixels_.size() + 1);
  arcs.reserve(4 * pixels_.size());
  for (int ring = 0; ring < rings_; ++ring)
    for (int angle = 0; angle < angles_; ++angle) {
      first.push_back(static_cast<std::int32_t>(arcs.size()));
      const int next = (angle + 1) % angles_, last = (angle + angles_ - 1) % angles_;
      arcs.push_back({ring * angles_ + next, first_of(ring, next) + 1});
      arcs.push_back({ring * angles_ + last, first_of(ring, last)});
      if (ring + 1 < rings_) arcs.push_back({(ring + 1) * angles_ + angle, first_of(ring + 1, angle) + (ring + 2 < rings_ ? 3 : 2)});
      if (ring > 0) arcs.push_back({(ring - 1) * angles_ + angle, first_of(ring - 1, angle) + 2});
    }
  first.push_back(static_cast<std::int32_t>(arcs.size()));
  return common::CutGraph(std::move(first), std::move(arcs));
}

}  // namespace swarmfit::perception
