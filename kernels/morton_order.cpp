#include "kernels/morton_order.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "kernels/bit_spread.hpp"
#include "kernels/cpu/tasks.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::kernels {
namespace {

constexpr int kKeyBits = 24, kDigitBits = 8;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr std::size_t kLeastChunk = 16384;
constexpr std::size_t kMostChunks = 64;
constexpr std::size_t kSample = 1024;
constexpr std::size_t kMostAtOnce = std::size_t{1} << 20;  ///< points beyond which memory counts for more than a few milliseconds

/// Where most of a column lies: from its 2nd to its 98th percentile, by a sample, and a quarter more on both sides. Strays do not count.
std::pair<float, float> bulk(const float* column, std::size_t count) {
  Reused<float> sample;
  const std::size_t stride = count / kSample + 1;
  for (std::size_t i = 0; i < count; i += stride) sample.push_back(column[i]);
  const auto place = [&](std::size_t k) { return sample.begin() + static_cast<std::ptrdiff_t>(k); };
  const std::size_t lower = sample.size() / 50, upper = sample.size() - 1 - lower;
  std::nth_element(sample.begin(), place(lower), sample.end());
  const float low = sample[lower];
  std::nth_element(place(lower), place(upper), sample.end());
  const float high = sample[upper];
  const float margin = (high - low) / 4;
  return {low - margin, high + margin};
}

/// The list in chunks of rows, fixed by its length alone.
struct Chunks {
  std::size_t points, rows, count;

  explicit Chunks(std::size_t all)
      : points(all), rows(std::max(kLeastChunk, (all + kMostChunks - 1) / kMostChunks)), count((all + rows - 1) / rows) {}
  /// body(chunk, first, last) for each, side by side.
  template <class Body>
  void each(Body&& body) const {
    cpu::for_each_task(count, [&](std::size_t chunk) { body(chunk, chunk * rows, std::min(points, (chunk + 1) * rows)); });
  }
};

/// Counts of digits, a chunk after another, to the places where each chunk's begin; returns where each digit's do, and the end.
std::array<std::uint32_t, kDigits + 1> places(std::vector<std::uint32_t>& counts, std::size_t chunks) {
  std::array<std::uint32_t, kDigits + 1> begins{};
  std::uint32_t at = 0;
  for (std::size_t digit = 0; digit < kDigits; ++digit) {
    begins[digit] = at;
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) at += std::exchange(counts[chunk * kDigits + digit], at);
  }
  begins[kDigits] = at;
  return begins;
}

}  // namespace

void MortonOrder::sort(std::span<const float* const> columns, std::size_t count, std::vector<std::uint32_t>& order) {
  const std::size_t dimensions = columns.size();
  std::array<float, 3> low{};
  double widest = 0;
  for (std::size_t c = 0; c < dimensions; ++c) {
    const auto [from, to] = bulk(columns[c], count);
    low[c] = from;
    widest = std::max(widest, static_cast<double>(to) - static_cast<double>(from));
  }
  // Cells are cubes.
  const int bits = kKeyBits / static_cast<int>(dimensions);
  const auto most = static_cast<float>((std::size_t{1} << bits) - 1);
  const auto scale = static_cast<float>(widest > 0 ? static_cast<double>(most) / widest : 0.0);
  const BitSpread spread(static_cast<int>(dimensions));
  const auto key = [&](std::size_t i) {
    std::uint32_t whole = 0;
    for (std::size_t c = 0; c < dimensions; ++c) {
      const float cell = std::min(std::max(0.0F, (columns[c][i] - low[c]) * scale), most);  // NaN, of infinities, becomes 0
      whole |= static_cast<std::uint32_t>(spread(static_cast<std::uint32_t>(static_cast<std::int32_t>(cell)))) << c;
    }
    return whole;
  };
  order.resize(count);
  if (count <= kMostAtOnce) {
    sort_at_once(key, order);
  } else {
    sort_in_buckets(key, order);
  }
}

template <class Key>
void MortonOrder::sort_at_once(const Key& key, std::span<std::uint32_t> order) {
  const Chunks chunks(order.size());
  entries_.resize(order.size());
  scratch_.resize(order.size());
  chunks.each([&](std::size_t, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) entries_[i] = std::uint64_t{key(i)} << 32 | i;
  });
  for (int shift = 32; shift < 32 + kKeyBits; shift += kDigitBits) {
    histogram_.assign(chunks.count * kDigits, 0);
    chunks.each([&](std::size_t chunk, std::size_t first, std::size_t last) {
      std::uint32_t* counts = histogram_.data() + chunk * kDigits;
      for (std::size_t i = first; i < last; ++i) ++counts[(entries_[i] >> shift) % kDigits];
    });
    places(histogram_, chunks.count);
    chunks.each([&](std::size_t chunk, std::size_t first, std::size_t last) {
      std::uint32_t* starts = histogram_.data() + chunk * kDigits;
      for (std::size_t i = first; i < last; ++i) scratch_[starts[(entries_[i] >> shift) % kDigits]++] = entries_[i];
    });
    entries_.swap(scratch_);
  }
  chunks.each([&](std::size_t, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) order[i] = static_cast<std::uint32_t>(entries_[i]);
  });
}

template <class Key>
void MortonOrder::sort_in_buckets(const Key& key, std::span<std::uint32_t> order) {
  constexpr int kLowerBits = kKeyBits - kDigitBits;
  const Chunks chunks(order.size());
  // By the uppermost digit first.
  histogram_.assign(chunks.count * kDigits, 0);
  chunks.each([&](std::size_t chunk, std::size_t first, std::size_t last) {
    std::uint32_t* counts = histogram_.data() + chunk * kDigits;
    for (std::size_t i = first; i < last; ++i) ++counts[key(i) >> kLowerBits];
  });
  const auto bucket = places(histogram_, chunks.count);
  std::vector<std::uint16_t> lower(order.size());
  chunks.each([&](std::size_t chunk, std::size_t first, std::size_t last) {
    std::uint32_t* starts = histogram_.data() + chunk * kDigits;
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t whole = key(i), at = starts[whole >> kLowerBits]++;
      order[at] = static_cast<std::uint32_t>(i);
      lower[at] = static_cast<std::uint16_t>(whole);
    }
  });
  // Then each bucket by the two others.
  cpu::for_each_task(kDigits, [&](std::size_t b) {
    const std::size_t first = bucket[b], size = bucket[b + 1] - first;
    std::vector<std::uint64_t> entries(size), room(size);
    for (std::size_t i = 0; i < size; ++i) entries[i] = std::uint64_t{lower[first + i]} << 32 | order[first + i];
    for (int shift = 32; shift < 32 + kLowerBits; shift += kDigitBits) {
      std::array<std::uint32_t, kDigits> at{};
      for (const std::uint64_t entry : entries) ++at[(entry >> shift) % kDigits];
      std::exclusive_scan(at.begin(), at.end(), at.begin(), 0U);
      for (const std::uint64_t entry : entries) room[at[(entry >> shift) % kDigits]++] = entry;
      entries.swap(room);
    }
    for (std::size_t i = 0; i < size; ++i) order[first + i] = static_cast<std::uint32_t>(entries[i]);
  });
}

}  // namespace swarmfit::kernels
