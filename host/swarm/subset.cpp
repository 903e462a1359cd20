#include "host/swarm/subset.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>

#include "host/common/ranges.hpp"
#include "kernels/bit_spread.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::swarm {
namespace {

/// Interleaves the bits of the quantised columns, of `bits` each.
template <std::size_t D>
std::uint64_t morton(const std::array<double, D>& p, const kernels::BitSpread& spread, int bits) {
  std::uint64_t code = 0;
  for (std::size_t d = 0; d < D; ++d) {
    // The working frame has unit spread: +-4 holds all but far outliers, which are clamped.
    const double t = std::clamp((p[d] + 4.0) / 8.0, 0.0, 1.0);
    const auto cell = static_cast<std::uint32_t>(t * ((1U << bits) - 1U));
    code |= spread(cell) << (D - 1 - d);
  }
  return code;
}

template <class Code>
struct Coded {
  Code code;
  std::uint32_t index;
};

/// Sorts by code; what has the same stays in its order. A digit of so many bits at a time, from the lowest, all of them counted before.
template <int DigitBits, class Code>
void sort_by_digits(std::vector<Coded<Code>>& coded, int bits) {
  constexpr std::size_t kDigits = std::size_t{1} << DigitBits, kMostPasses = (8 * sizeof(Code) + DigitBits - 1) / DigitBits;
  const auto passes = static_cast<std::size_t>((bits + DigitBits - 1) / DigitBits);
  const auto digit = [](Code code, std::size_t pass) { return static_cast<std::size_t>(code >> (pass * DigitBits)) & (kDigits - 1); };
  std::array<std::array<std::uint32_t, kDigits>, kMostPasses> at{};
  for (const Coded<Code>& one : coded) {
    for (std::size_t pass = 0; pass < passes; ++pass) ++at[pass][digit(one.code, pass)];
  }
  kernels::Reused<Coded<Code>> room(coded.size());
  for (std::size_t pass = 0; pass < passes; ++pass) {
    std::exclusive_scan(at[pass].begin(), at[pass].end(), at[pass].begin(), 0U);
    for (const Coded<Code>& one : coded) room[at[pass][digit(one.code, pass)]++] = one;
    coded.swap(room);
  }
}

template <class Code>
void sort_by_code(std::vector<Coded<Code>>& coded, int bits) {
  constexpr std::size_t kFew = 4096;  // to count many digits would take as long as to count the points
  coded.size() < kFew ? sort_by_digits<8>(coded, bits) : sort_by_digits<11>(coded, bits);
}

/// Of what takes a thread some nanoseconds each: a multiple of 64 of them are taken at a time.
template <class Some>
void share(kernels::FitnessEvaluator* workers, std::size_t count, Some&& some) {
  constexpr std::size_t kRange = 1024, kFew = 4095;
  common::in_ranges(workers, count, kRange, kFew, some);
}

template <std::size_t D, class Code>
kernels::Reused<std::uint32_t> in_morton_order(const models::WorkingPoints& points, std::span<const std::uint32_t> part, int bits,
                                               kernels::FitnessEvaluator* workers) {
  kernels::Reused<Coded<Code>> coded(part.size());
  const kernels::BitSpread spread(static_cast<int>(D));
  share(workers, part.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) coded[k] = {static_cast<Code>(morton<D>(points.row<D>(part[k]), spread, bits)), part[k]};
  });
  sort_by_code(coded, bits * static_cast<int>(D));
  kernels::Reused<std::uint32_t> index(coded.size());
  std::transform(coded.begin(), coded.end(), index.begin(), [](const Coded<Code>& one) { return one.index; });
  return index;
}

kernels::Reused<std::uint32_t> in_morton_order(const models::WorkingPoints& points, std::span<const std::uint32_t> part,
                                               kernels::FitnessEvaluator* workers) {
  constexpr int kCellBits = 16;  // of a column
  // Points of a part of the cloud are farther apart: three digits tell them apart as well, also where some are far from all others.
  constexpr int kPartCellBits = 11, kPartCellBitsOf3 = 10;
  const bool all = part.size() == points.finite_count();
  switch (points.dimension()) {
    case 2: return in_morton_order<2, std::uint32_t>(points, part, all ? kCellBits : kPartCellBits, workers);
    case 3:
      return all ? in_morton_order<3, std::uint64_t>(points, part, kCellBits, workers)
                 : in_morton_order<3, std::uint32_t>(points, part, kPartCellBitsOf3, workers);
    default: return in_morton_order<4, std::uint64_t>(points, part, all ? kCellBits : kPartCellBits, workers);
  }
}

constexpr std::size_t kUsual = 3 * sizeof(float);  // bytes of a row, which a copy of known size is quickest for

template <std::size_t Bytes>
void copy_rows(const std::byte* from, std::size_t stride, std::span<const std::uint32_t> index, std::byte* to) {
  for (const std::uint32_t i : index) {
    std::memcpy(to, from + i * stride, Bytes);
    to += Bytes;
  }
}

}  // namespace

kernels::Reused<std::uint32_t> draw_part(const models::WorkingPoints& points, const Random& random, std::uint32_t number, std::size_t size,
                                         kernels::FitnessEvaluator* workers) {
  const std::size_t n = points.finite_count(), runs = std::min(n, size);
  kernels::Reused<std::uint32_t> drawn(runs);
  if (runs == 0) return drawn;
  // Run k begins at floor(n k / runs).
  const std::size_t whole = n / runs, rest = n % runs;
  // Where runs are short half a word tells a point: as even as one can see, for half the random numbers.
  constexpr std::size_t kShort = 1024;
  const bool halves = whole < kShort;
  const std::size_t at_once = halves ? 8 : 4;
  share(workers, runs, [&](std::size_t first, std::size_t end) {
    models::FiniteWalk walk = points.walk();
    std::array<std::uint32_t, 8> words{};
    std::size_t from = whole * first + rest * first / runs, over = rest * first % runs;
    auto block = static_cast<std::uint32_t>(first / at_once);
    for (std::size_t k = first; k < end; ++block) {
      const auto four = runs < n ? random.words(Draw::subset, number, 0, block) : std::array<std::uint32_t, 4>{};
      for (std::size_t w = 0; w < 4; ++w) {
        words[halves ? 2 * w : w] = four[w];
        if (halves) words[2 * w + 1] = four[w] << 16;
      }
      const std::size_t last = std::min(end, k + at_once);
      for (std::size_t w = 0; k < last; ++k, ++w) {
        over += rest;
        const bool longer = over >= runs;
        over -= longer ? runs : 0;
        const std::size_t length = whole + (longer ? 1 : 0);
        drawn[k] = walk.to(from + Random::below(words[w], length));
        from += length;
      }
    }
  });
  return drawn;
}

namespace {

/// `s` for which the sum of min(1, s / spread) over the finite points is `size`, which is less than their number.
double share_of_steady(const models::WorkingPoints& points, std::span<const float> spread, std::size_t size) {
  constexpr int kMostRounds = 20;  // each may find more points that are taken in any case, and seldom do five
  double share = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    double sure = 0, worth = 0;
    for (std::size_t i = 0; i < spread.size(); ++i) {
      if (!points.finite(i)) continue;
      const auto each = static_cast<double>(spread[i]);
      sure += share >= each ? 1 : 0;
      worth += share >= each ? 0 : 1 / each;
    }
    const double next = worth > 0 ? (static_cast<double>(size) - sure) / worth : share;
    if (!(next > share)) break;
    share = next;
  }
  return share;
}

}  // namespace

kernels::Reused<std::uint32_t> draw_steady_part(const models::WorkingPoints& points, const Random& random, std::uint32_t number,
                                                std::size_t size, std::span<const float> spread) {
  if (points.finite_count() <= size) return draw_part(points, random, number, size);
  const double share = share_of_steady(points, spread, size);
  kernels::Reused<std::uint32_t> drawn;
  drawn.reserve(size + size / 8);
  std::array<std::uint32_t, 4> words{};
  for (std::size_t i = 0; i < spread.size(); ++i) {
    if (i % 4 == 0) words = random.words(Draw::subset, number, 0, static_cast<std::uint32_t>(i / 4));
    if (points.finite(i) && Random::unit(words[i % 4]) * static_cast<double>(spread[i]) < share)
      drawn.push_back(static_cast<std::uint32_t>(i));
  }
  return drawn;
}

Rows::Rows(const kernels::PointsView& points, std::span<const std::uint32_t> index, kernels::FitnessEvaluator* workers)
    : scalar_(points.scalar == kernels::Scalar::float32 ? PointsView::Scalar::float32 : PointsView::Scalar::float64),
      dimension_(points.dimension),
      width_(static_cast<std::size_t>(points.dimension) * (points.scalar == kernels::Scalar::float32 ? sizeof(float) : sizeof(double))),
      bytes_(index.size() * width_) {
  const auto* const from = static_cast<const std::byte*>(points.data);
  share(workers, index.size(), [&](std::size_t first, std::size_t last) {
    if (width_ == kUsual) return copy_rows<kUsual>(from, points.stride, index.subspan(first, last - first), bytes_.data() + first * width_);
    for (std::size_t k = first; k < last; ++k) std::memcpy(bytes_.data() + k * width_, from + index[k] * points.stride, width_);
  });
}

PointsView Rows::view() const noexcept { return {bytes_.data(), scalar_, dimension_, bytes_.size() / width_, width_}; }

Subset::Subset(const models::WorkingPoints& points, std::span<const std::uint32_t> drawn, kernels::FitnessEvaluator* workers)
    : index_(in_morton_order(points, drawn, workers)), rows_(points.view(), index_, workers) {}

void Subset::gather(std::span<const float> all, std::vector<float>& values) const {
  values.resize(index_.size());
  for (std::size_t k = 0; k < index_.size(); ++k) values[k] = all[index_[k]];
}

Part part_to_look_at(const models::WorkingPoints& points, const Random& random, std::size_t size, kernels::FitnessEvaluator* workers,
                     std::span<const float> spread) {
  const kernels::Reused<std::uint32_t> drawn = spread.empty() ? draw_part(points, random, kSearchedPart, size, workers)
                                                              : draw_steady_part(points, random, kSearchedPart, size, spread);
  return {Subset(points, drawn, workers), {}};
}

void learn_neighbourhoods(Part& part, models::WorkingPoints& points, const models::ModelSpace& space, kernels::FitnessEvaluator* workers,
                          std::span<const float> left) {
  constexpr std::size_t kNeighbours = 16;
  const bool correspondences = points.dimension() > 3;
  if (!correspondences && !space.agrees_by_normals()) return;
  const std::span<const std::uint32_t> index = part.points.index();
  kernels::Reused<std::uint8_t> asked(left.size());
  std::transform(left.begin(), left.end(), asked.begin(), [](float cap) -> std::uint8_t { return cap > 0 ? 1 : 0; });
  part.neighbours = models::Neighbours(points, index, kNeighbours, workers, asked);
  if (!space.agrees_by_normals()) return;
  const kernels::Reused<Eigen::Vector3f> known = models::estimate_normals(points, index, part.neighbours, workers, asked);
  kernels::Reused<Eigen::Vector3f> normals(points.size(), Eigen::Vector3f::Zero());
  for (std::size_t k = 0; k < known.size(); ++k) normals[part.points.index()[k]] = known[k];
  points.set_normals(std::move(normals));
}

Part look_closely(models::WorkingPoints& points, const models::ModelSpace& space, const Random& random, std::size_t size,
                  kernels::FitnessEvaluator* workers, std::span<const float> spread) {
  Part part = part_to_look_at(points, random, size, workers, spread);
  learn_neighbourhoods(part, points, space, workers);
  return part;
}

}  // namespace swarmfit::swarm
