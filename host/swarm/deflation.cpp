#include "host/swarm/deflation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kFurthest = Support::kSlabs - 2;  // slabs that a tail may fill
constexpr double kTailShare = 0.12;                     // of what the model's own slab holds above the next one
constexpr double kDeviations = 3;                       // a fall that chance would not make

}  // namespace

int tail_reach(const Support& support) {
  std::array<double, Support::kSlabs> slab;
  std::transform(support.slabs.begin(), support.slabs.end(), slab.begin(), [](std::size_t n) { return static_cast<double>(n); });
  // A tail falls from slab to slab until it meets the surroundings, which stay level.
  int reach = 1;
  for (std::size_t k = 1; k <= kFurthest; ++k) {
    const double fall = slab[k] - slab[k + 1];
    const bool tail = fall > kTailShare * (slab[0] - slab[k + 1]) && fall > kDeviations * std::sqrt(slab[k] + slab[k + 1]);
    if (!tail) break;
    ++reach;
  }
  return reach;
}

void deflate(std::span<const float> distances, float tau, int reach, double slope, std::span<float> caps, std::span<const float> allowed) {
  const auto steep = static_cast<float>(slope);
  if (!allowed.empty()) {
    for (std::size_t i = 0; i < caps.size(); ++i) {
      const float left = steep * (distances[i] - static_cast<float>(reach) * allowed[i]);
      caps[i] = left < caps[i] ? std::max(left, 0.0F) : caps[i];
    }
    return;
  }
  const float width = static_cast<float>(reach) * tau;
  for (std::size_t i = 0; i < caps.size(); ++i) {
    const float left = steep * (distances[i] - width);
    caps[i] = left < caps[i] ? (left > 0 ? left : 0.0F) : caps[i];
  }
}

}  // namespace swarmfit::swarm
