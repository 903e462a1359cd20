#include "host/swarm/sampler.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "kernels/reused.hpp"

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
  if (!neighbours.empty()) alive_.assign(candidates.size(), 1);
}

template <class Stays>
bool Sampler::leave_out(const Stays& stays, std::size_t enough) {
  const auto all = static_cast<std::uint32_t>(candidates_.size());
  live_.resize(all);
  std::uint32_t* const live = live_.data();
  std::size_t kept = 0;
  for (std::uint32_t place = 0; place < all; ++place) {
    live[kept] = place;  // overwritten by the next if it is not alive
    kept += stays(place) ? 1 : 0;
  }
  for (std::uint32_t place = 0; place < alive_.size(); ++place) alive_[place] = stays(place) ? 1 : 0;
  live_.resize(kept);
  if (live_.size() >= enough) return true;
  live_.resize(candidates_.size());
  std::iota(live_.begin(), live_.end(), 0U);
  alive_.assign(alive_.size(), 1);
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

void Sampler::choose(const Ask& ask, std::uint32_t round, std::uint32_t step, std::uint32_t attempt,
                     std::span<std::uint32_t> sample) const {
  const auto blocks = static_cast<std::uint32_t>((sample.size() + kWords - 1) / kWords);
  std::array<std::uint32_t, 8> words{};
  for (std::uint32_t block = 0; block < blocks; ++block) {
    const auto four = random_.words(Draw::sample, round, step * 2 + block, ask.particle * kAttempts + attempt);
    std::copy(four.begin(), four.end(), words.begin() + kWords * block);
  }
  const std::size_t first = Random::below(words[0], live_.size());
  sample[0] = live_[first];
  const bool near = ask.local && nearby(first, std::span(words).subspan(1), sample.subspan(1));
  for (std::size_t k = 1; k < sample.size(); ++k) {
    if (!near) sample[k] = live_[Random::below(words[k], live_.size())];
  }
  for (std::uint32_t& place : sample) place = candidates_[place];
}

void Sampler::draw(std::span<const Ask> asks, std::uint32_t round, std::uint32_t step, std::span<models::Position> thetas,
                   std::span<std::uint8_t> drawn) const {
  const auto wanted = static_cast<std::size_t>(space_.minimal_sample());
  const std::size_t at_once = space_.samples_at_once();
  std::fill(drawn.begin(), drawn.end(), std::uint8_t{0});
  kernels::Reused<std::uint32_t> left(asks.size()), samples;
  std::iota(left.begin(), left.end(), 0U);
  kernels::Reused<models::Position> found;
  kernels::Reused<std::uint8_t> sound;
  for (std::uint32_t attempt = 0; attempt < kAttempts && !left.empty();) {
    // Where few are left, several attempts of each fill what is solved at a time; the first that succeeds counts, as if made one by one.
    const auto ahead = static_cast<std::uint32_t>(std::max<std::size_t>(1, at_once / left.size()));
    const std::uint32_t attempts = std::min(kAttempts - attempt, ahead);
    const std::size_t count = left.size() * attempts;
    samples.resize(count * wanted);
    found.resize(count);
    sound.resize(count);
    for (std::size_t k = 0; k < count; ++k) {
      const auto more = static_cast<std::uint32_t>(k % attempts);
      choose(asks[left[k / attempts]], round, step, attempt + more, std::span(samples).subspan(k * wanted, wanted));
    }
    space_.from_samples(points_, samples, found, sound);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t ask = left[k / attempts];
      if (sound[k] == 0 || drawn[ask] != 0) continue;
      thetas[ask] = found[k];
      drawn[ask] = 1;
    }
    left.erase(std::remove_if(left.begin(), left.end(), [&](std::uint32_t ask) { return drawn[ask] != 0; }), left.end());
    attempt += attempts;
  }
}

kernels::Reused<models::Position> Sampler::draw_some(std::uint32_t count, std::uint32_t local_every, std::uint32_t round) const {
  kernels::Reused<Ask> asks(count);
  for (std::uint32_t k = 0; k < count; ++k) asks[k] = {k, k % local_every == 0};
  kernels::Reused<models::Position> thetas(count), found;
  kernels::Reused<std::uint8_t> drawn(count);
  draw(asks, round, 0, thetas, drawn);
  for (std::size_t k = 0; k < thetas.size(); ++k) {
    if (drawn[k] != 0) found.push_back(thetas[k]);
  }
  return found;
}

}  // namespace swarmfit::swarm
