#include "host/swarm/sampler.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace swarmfit::swarm {
namespace {

constexpr std::size_t kSubset = 4096;   // enough to tell surfaces apart, cheap to sort
constexpr int kAttempts = 32;           // of a sample that turns out degenerate
constexpr std::size_t kReach = 12;      // places in Morton order that count as nearby

/// Interleaves the bits of up to four quantised columns.
std::uint64_t morton(const models::WorkingPoints& points, std::size_t i) {
  const int dim = points.dimension();
  const int bits = 64 / std::max(dim, 2) > 16 ? 16 : 64 / dim;
  std::uint64_t code = 0;
  std::array<std::uint32_t, models::kMaxDimension> cell{};
  for (int d = 0; d < dim; ++d) {
    // The working frame has unit spread: +-4 holds all but far outliers, which are clamped.
    const double t = std::clamp((points.at(i, d) + 4.0) / 8.0, 0.0, 1.0);
    cell[static_cast<std::size_t>(d)] = static_cast<std::uint32_t>(t * ((1U << bits) - 1U));
  }
  for (int b = bits - 1; b >= 0; --b) {
    for (int d = 0; d < dim; ++d) code = (code << 1) | ((cell[static_cast<std::size_t>(d)] >> b) & 1U);
  }
  return code;
}

}  // namespace

Sampler::Sampler(const models::WorkingPoints& points, const models::ModelSpace& space, const Random& random)
    : points_(points), space_(space), random_(random) {
  const std::size_t n = points.finite_count();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> coded;
  coded.reserve(std::min(n, kSubset));
  if (n <= kSubset) {
    for (std::size_t k = 0; k < n; ++k) coded.emplace_back(0, points.finite_index(k));
  } else {
    // One point of each of equal runs of the input, so that a scan or an image is covered evenly.
    for (std::size_t k = 0; k < kSubset; ++k) {
      const std::size_t from = n * k / kSubset, to = n * (k + 1) / kSubset;
      const std::uint32_t word = random.words(Draw::subset, 0, 0, static_cast<std::uint32_t>(k))[0];
      coded.emplace_back(0, points.finite_index(from + Random::below(word, to - from)));
    }
  }
  for (auto& [code, index] : coded) code = morton(points, index);
  std::sort(coded.begin(), coded.end());
  for (const auto& [code, index] : coded) ordered_.push_back(index);
  live_ = ordered_;
}

void Sampler::prefer_unexplained(std::span<const float> caps, double full_share, float full) {
  live_.clear();
  for (const std::uint32_t i : ordered_) {
    if (caps[i] >= full_share * full) live_.push_back(i);
  }
  if (live_.size() < static_cast<std::size_t>(4 * space_.minimal_sample())) live_ = ordered_;
}

bool Sampler::draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const {
  const auto wanted = static_cast<std::size_t>(space_.minimal_sample());
  std::array<std::uint32_t, 8> sample{};
  for (std::uint32_t attempt = 0; attempt < kAttempts; ++attempt) {
    std::array<std::uint32_t, 8> words{};
    for (std::uint32_t block = 0; block < 2; ++block) {
      const auto four = random_.words(Draw::sample, round, step * 2 + block, particle * kAttempts + attempt);
      std::copy(four.begin(), four.end(), words.begin() + 4 * block);
    }
    const std::size_t first = Random::below(words[0], live_.size());
    sample[0] = live_[first];
    for (std::size_t k = 1; k < wanted; ++k) {
      std::size_t at = Random::below(words[k], live_.size());
      if (local) {
        const std::size_t low = first > kReach ? first - kReach : 0;
        const std::size_t high = std::min(live_.size(), first + kReach + 1);
        at = low + Random::below(words[k], high - low);
      }
      sample[k] = live_[at];
    }
    if (space_.from_sample(points_, std::span<const std::uint32_t>(sample.data(), wanted), theta)) return true;
  }
  return false;
}

}  // namespace swarmfit::swarm
