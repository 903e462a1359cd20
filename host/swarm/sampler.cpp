#include "host/swarm/sampler.hpp"

#include <algorithm>
#include <array>

namespace swarmfit::swarm {
namespace {

constexpr std::uint32_t kAttempts = 32;  // of a sample that turns out degenerate
constexpr double kNearby = 0.003;        // of the candidates, on each side of a point in their order, are nearby
constexpr std::size_t kLeastNearby = 12;

}  // namespace

Sampler::Sampler(const models::WorkingPoints& points, std::span<const std::uint32_t> candidates, const models::ModelSpace& space,
                 const Random& random)
    : points_(points), space_(space), random_(random), candidates_(candidates), live_(candidates.begin(), candidates.end()) {}

void Sampler::prefer_unexplained(std::span<const float> caps, float full) {
  live_.clear();
  for (const std::uint32_t i : candidates_) {
    if (caps[i] >= 0.5F * full) live_.push_back(i);
  }
  if (live_.size() < static_cast<std::size_t>(4 * space_.minimal_sample())) live_.assign(candidates_.begin(), candidates_.end());
}

bool Sampler::draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const {
  const auto wanted = static_cast<std::size_t>(space_.minimal_sample());
  const std::size_t reach = std::max(kLeastNearby, static_cast<std::size_t>(kNearby * static_cast<double>(candidates_.size())));
  std::array<std::uint32_t, 8> sample{}, words{};
  for (std::uint32_t attempt = 0; attempt < kAttempts; ++attempt) {
    for (std::uint32_t block = 0; block < 2; ++block) {
      const auto four = random_.words(Draw::sample, round, step * 2 + block, particle * kAttempts + attempt);
      std::copy(four.begin(), four.end(), words.begin() + 4 * block);
    }
    const std::size_t first = Random::below(words[0], live_.size());
    sample[0] = live_[first];
    for (std::size_t k = 1; k < wanted; ++k) {
      std::size_t at = Random::below(words[k], live_.size());
      if (local) {
        const std::size_t low = first > reach ? first - reach : 0;
        at = low + Random::below(words[k], std::min(live_.size(), first + reach + 1) - low);
      }
      sample[k] = live_[at];
    }
    if (space_.from_sample(points_, std::span<const std::uint32_t>(sample.data(), wanted), theta)) return true;
  }
  return false;
}

}  // namespace swarmfit::swarm
