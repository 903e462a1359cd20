#include "host/swarm/sampler.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace swarmfit::swarm {
namespace {

constexpr std::uint32_t kAttempts = 32;  // of a sample that turns out degenerate
constexpr std::size_t kWords = 4;        // random ones that are drawn at a time
constexpr double kNearby = 0.003;        // of the candidates, on each side of a point in their order, are nearby
constexpr std::size_t kLeastNearby = 12;
constexpr std::size_t kMostNeighbours = 32;

}  // namespace

Sampler::Sampler(const models::WorkingPoints& points, std::span<const std::uint32_t> candidates, const models::Neighbours& neighbours,
                 const models::ModelSpace& space, const Random& random)
    : points_(points), space_(space), random_(random), candidates_(candidates), neighbours_(neighbours), live_(candidates.size()) {
  std::iota(live_.begin(), live_.end(), 0U);
  alive_.assign(candidates.size(), 1);
}

template <class Stays>
bool Sampler::leave_out(const Stays& stays, std::size_t enough) {
  live_.resize(candidates_.size());
  std::size_t kept = 0;
  for (std::uint32_t place = 0; place < candidates_.size(); ++place) {
    const bool alive = stays(place);
    alive_[place] = alive ? 1 : 0;
    live_[kept] = place;  // overwritten by the next if it is not alive
    kept += alive ? 1 : 0;
  }
  live_.resize(kept);
  if (live_.size() >= enough) return true;
  live_.resize(candidates_.size());
  std::iota(live_.begin(), live_.end(), 0U);
  alive_.assign(candidates_.size(), 1);
  return false;
}

void Sampler::prefer_unexplained(std::span<const float> caps, float least) {
  leave_out([&](std::uint32_t place) { return caps[place] >= least; }, static_cast<std::size_t>(4 * space_.minimal_sample()));
}

bool Sampler::keep_to(std::span<const float> marks) {
  constexpr float kMarked = 0.5F;
  return leave_out([&](std::uint32_t place) { return marks[candidates_[place]] >= kMarked; },
                   static_cast<std::size_t>(space_.minimal_sample() + 2));
}

bool Sampler::nearby(std::size_t first, std::span<const std::uint32_t> words, std::span<std::uint32_t> places) const {
  if (neighbours_.empty()) {
    const std::size_t reach = std::max(kLeastNearby, static_cast<std::size_t>(kNearby * static_cast<double>(candidates_.size())));
    const std::size_t low = first > reach ? first - reach : 0;
    const std::size_t width = std::min(live_.size(), first + reach + 1) - low;
    for (std::size_t k = 0; k < places.size(); ++k) places[k] = live_[low + Random::below(words[k], width)];
    return true;
  }
  std::array<std::uint32_t, kMostNeighbours> near{};
  std::size_t count = 0;
  for (const std::uint32_t place : neighbours_.of(live_[first])) {
    if (alive_[place] != 0 && count < near.size()) near[count++] = place;
  }
  if (count < places.size()) return false;
  // Without repetition: a sample that holds a point twice is degenerate.
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::size_t at = k + Random::below(words[k], count - k);
    std::swap(near[k], near[at]);
    places[k] = near[k];
  }
  return true;
}

bool Sampler::draw(bool local, std::uint32_t round, std::uint32_t step, std::uint32_t particle, models::Position& theta) const {
  const auto wanted = static_cast<std::size_t>(space_.minimal_sample());
  std::array<std::uint32_t, 8> sample{}, words{};
  for (std::uint32_t attempt = 0; attempt < kAttempts; ++attempt) {
    for (std::uint32_t block = 0; block < (wanted + kWords - 1) / kWords; ++block) {
      const auto four = random_.words(Draw::sample, round, step * 2 + block, particle * kAttempts + attempt);
      std::copy(four.begin(), four.end(), words.begin() + kWords * block);
    }
    const std::size_t first = Random::below(words[0], live_.size());
    sample[0] = live_[first];
    const std::span<std::uint32_t> others(sample.data() + 1, wanted - 1);
    const bool near = local && nearby(first, std::span(words).subspan(1), others);
    for (std::size_t k = 1; k < wanted; ++k) {
      if (!near) sample[k] = live_[Random::below(words[k], live_.size())];
    }
    for (std::size_t k = 0; k < wanted; ++k) sample[k] = candidates_[sample[k]];
    if (space_.from_sample(points_, std::span<const std::uint32_t>(sample.data(), wanted), theta)) return true;
  }
  return false;
}

}  // namespace swarmfit::swarm
