#include "host/swarm/deflation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace swarmfit::swarm {
namespace {

constexpr int kFurthest = 5;         // slabs that a tail may fill
constexpr double kTailShare = 0.12;  // of what the model's own slab holds above the next one
constexpr double kDeviations = 3;    // a fall that chance would not make

}  // namespace

int tail_reach(std::span<const float> distances, std::span<const float> caps, float tau) {
  std::array<double, kFurthest + 2> slab{};
  const auto furthest = static_cast<float>(slab.size());
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (!(caps[i] >= 0.5F * tau) || !(distances[i] < furthest * tau)) continue;  // NaN fails the second test
    slab[static_cast<std::size_t>(distances[i] / tau)] += 1;
  }
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

void deflate(std::span<const float> distances, float tau, int reach, double slope, std::span<float> caps) {
  const auto steep = static_cast<float>(slope);
  const auto width = static_cast<float>(reach);
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (std::isnan(distances[i])) continue;
    caps[i] = std::min(caps[i], std::max(0.0F, steep * (distances[i] - width * tau)));
  }
}

}  // namespace swarmfit::swarm
