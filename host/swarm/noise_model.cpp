#include "host/swarm/noise_model.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

constexpr int kDepth = 2;            // the column
constexpr double kNear = 0.3;        // share of the points that are nearer than what tau is for; one near thing makes no near end
constexpr double kMostSpread = 1e4;  // a hundred times as far as that: noise tells nothing there

}  // namespace

double near_depth(const models::WorkingPoints& points) {
  kernels::Reused<double> depths;
  depths.reserve(points.finite_count());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points.finite(i)) depths.push_back(std::abs(points.view().at(i, kDepth)));
  }
  if (depths.empty()) return 0;
  const auto near = depths.begin() + static_cast<std::ptrdiff_t>(kNear * static_cast<double>(depths.size()));
  std::nth_element(depths.begin(), near, depths.end());
  return *near;
}

kernels::Reused<float> spread_of(Noise noise, const models::WorkingPoints& points, double reference) {
  if (noise == Noise::none || !(reference > 0)) return {};
  kernels::Reused<float> spread(points.size(), 1.0F);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points.finite(i)) continue;
    const double ratio = points.view().at(i, kDepth) / reference;
    spread[i] = static_cast<float>(std::clamp(ratio * ratio, 1.0, kMostSpread));
  }
  return spread;
}

kernels::Reused<float> allowed_by(std::span<const float> spread, float tau) {
  kernels::Reused<float> allowed(spread.begin(), spread.end());
  for (float& v : allowed) v *= tau;
  return allowed;
}

}  // namespace swarmfit::swarm
