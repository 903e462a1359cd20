#include "host/perception/colour_cost.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::perception {
namespace {
constexpr std::uint16_t kUnknown = 65535, kWanted = 65534;
constexpr float kWhole = 65533;

std::uint16_t to_steps(float cost) { return static_cast<std::uint16_t>(cost * kWhole + 0.5f); }
}  // namespace

bool ColourWork::evaluate(const kernels::ColoursView& sample, int neighbours, const kernels::ColoursView& colours, std::span<float> costs) {
  {
    const std::lock_guard lock(mutex_);
    if (failure_) return false;
  }
  auto done = costs_.evaluate(sample, neighbours, colours, costs);
  if (done) return true;
  const std::lock_guard lock(mutex_);
  if (!failure_) failure_ = done.error();
  return false;
}

Hls to_hls(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  const int high = std::max({red, green, blue}), low = std::min({red, green, blue}), range = high - low, sum = high + low;
  Hls out{0, 0, 0};
  out.l = static_cast<float>(sum) / 510;
  if (range == 0) return out;  // grey has no hue
  out.s = static_cast<float>(range) / static_cast<float>(sum <= 255 ? sum : 510 - sum);
  const float unit = 1.0f / (6.0f * static_cast<float>(range));
  if (high == red) {
    out.h = static_cast<float>(green - blue) * unit;
  } else if (high == green) {
    out.h = static_cast<float>(blue - red) * unit + 1.0f / 3;
  } else {
    out.h = static_cast<float>(red - green) * unit + 2.0f / 3;
  }
  if (out.h < 0) out.h += 1;
  return out;
}

int neighbours_for(std::size_t sample_size) {
  return std::max(1, static_cast<int>(std::lround(0.5 * std::sqrt(static_cast<double>(sample_size)))));
}

void ColourSample::add(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  const Hls colour = to_hls(red, green, blue);
  hue_.push_back(colour.h);
  lightness_.push_back(colour.l);
  saturation_.push_back(colour.s);
}

void ColourSample::close(std::size_t largest) {
  const std::size_t size = hue_.size();
  if (size > largest) {
    for (std::size_t i = 0; i < largest; ++i) {
      const std::size_t from = i * size / largest;
      hue_[i] = hue_[from];
      lightness_[i] = lightness_[from];
      saturation_[i] = saturation_[from];
    }
    hue_.resize(largest);
    lightness_.resize(largest);
    saturation_.resize(largest);
  }
  if (neighbours_ <= 0) neighbours_ = neighbours_for(hue_.size());
  neighbours_ = std::min(neighbours_, static_cast<int>(std::max<std::size_t>(hue_.size(), 1)));
  distances_.resize(hue_.size());
  remembered_.assign(std::size_t{1} << (3 * bits_), kUnknown);
}

float ColourSample::cost(const Hls& colour) {
  if (empty()) return 1;
  const std::size_t size = hue_.size();
  const Hls query = colour;
  const float *hue = hue_.data(), *lightness = lightness_.data(), *saturation = saturation_.data();
  float* distance = distances_.data();
  for (std::size_t i = 0; i < size; ++i) distance[i] = colour_distance(query, {hue[i], lightness[i], saturation[i]});
  // The K nearest in order, the farthest last; few of the others come before it.
  nearest_.assign(static_cast<std::size_t>(neighbours_), std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < size; ++i) {
    const float d = distance[i];
    if (d >= nearest_.back()) continue;
    std::size_t at = nearest_.size() - 1;
    for (; at > 0 && nearest_[at - 1] > d; --at) nearest_[at] = nearest_[at - 1];
    nearest_[at] = d;
  }
  float sum = 0;
  for (const float d : nearest_) sum += d;
  return sum / static_cast<float>(neighbours_);
}

std::size_t ColourSample::key(std::uint8_t red, std::uint8_t green, std::uint8_t blue) const {
  const int drop = 8 - bits_;
  return (static_cast<std::size_t>(red >> drop) << (2 * bits_)) | (static_cast<std::size_t>(green >> drop) << bits_) |
         static_cast<std::size_t>(blue >> drop);
}

/// The middle of a key's cell stands for all of it.
Hls ColourSample::colour_of(std::size_t key) const {
  const int drop = 8 - bits_, middle = drop > 0 ? 1 << (drop - 1) : 0;
  const std::size_t mask = (std::size_t{1} << bits_) - 1;
  const auto channel = [&](int place) {
    return static_cast<std::uint8_t>(static_cast<int>(((key >> (place * bits_)) & mask) << drop) + middle);
  };
  return to_hls(channel(2), channel(1), channel(0));
}

void ColourSample::want(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  const std::size_t at = key(red, green, blue);
  if (remembered_[at] != kUnknown) return;
  remembered_[at] = kWanted;
  wanted_.push_back(static_cast<std::uint32_t>(at));
}

void ColourSample::settle(ColourWork* work) {
  if (work == nullptr || wanted_.empty() || neighbours_ > kernels::kMostNeighbours) return;
  const std::size_t count = wanted_.size();
  std::vector<float> columns(3 * count), costs(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Hls colour = colour_of(wanted_[i]);
    columns[i] = colour.h;
    columns[count + i] = colour.l;
    columns[2 * count + i] = colour.s;
  }
  const std::span<const float> all(columns);
  if (work->evaluate({hue_, lightness_, saturation_}, neighbours_, {all.first(count), all.subspan(count, count), all.last(count)}, costs))
    for (std::size_t i = 0; i < count; ++i) remembered_[wanted_[i]] = to_steps(costs[i]);
  wanted_.clear();
}

float ColourSample::cost(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  const std::size_t at = key(red, green, blue);
  if (remembered_[at] >= kWanted) remembered_[at] = to_steps(cost(colour_of(at)));
  return static_cast<float>(remembered_[at]) / kWhole;
}

}  // namespace swarmfit::perception
