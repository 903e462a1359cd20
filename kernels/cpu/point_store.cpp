#include "kernels/cpu/point_store.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "kernels/cpu/tasks.hpp"
#include "kernels/reused.hpp"

namespace swarmfit::kernels::cpu {
namespace {

/// Rows a task reads. Fixed, so that the centre does not depend on the number of threads.
constexpr std::size_t kChunkRows = 2048;
/// Points of a cloud whose memory counts for more than the time to ask for it anew.
constexpr std::size_t kLarge = std::size_t{1} << 20;
/// Blocks from which on their being small is worth the sort: of fewer, all are computed in no time.
constexpr std::size_t kSortedBlocks = 9;
/// Share of the points that may cost something from which on leaving out the others does not pay for the copy.
constexpr double kMostCostly = 0.8;

/// Calls visit(row, values) for each finite row in [first, last), with `values` its `Width` columns.
template <class S, std::size_t Width, class Visit>
void visit_finite(const PointsView& points, std::size_t first, std::size_t last, Visit&& visit) {
  const char* row_data = static_cast<const char*>(points.data) + first * points.stride;
  for (std::size_t row = first; row < last; ++row, row_data += points.stride) {
    std::array<S, Width> raw;
    std::memcpy(raw.data(), row_data, sizeof raw);
    S probe = 0;  // stays 0 unless a column is NaN or infinite
    for (const S value : raw) probe += value * 0;
    if (probe == 0) visit(row, raw);
  }
}

template <class S, class Visit>
void visit_rows(const PointsView& points, std::size_t first, std::size_t last, Visit&& visit) {
  switch (points.dimension) {
    case 2: return visit_finite<S, 2>(points, first, last, visit);
    case 3: return visit_finite<S, 3>(points, first, last, visit);
    default: return visit_finite<S, 4>(points, first, last, visit);
  }
}

template <class Visit>
void visit_chunk(const PointsView& points, std::size_t chunk, Visit&& visit) {
  const std::size_t first = chunk * kChunkRows;
  const std::size_t last = std::min(points.count, first + kChunkRows);
  if (points.scalar == Scalar::float32) return visit_rows<float>(points, first, last, visit);
  visit_rows<double>(points, first, last, visit);
}

}  // namespace

void PointStore::assign(const PointsView& points) {
  dimension_ = points.dimension;
  count_ = points.count;
  most_cap_ = 0;
  bounds_current_ = false;
  apart_ = false;
  Reused<Chunk> chunks((count_ + kChunkRows - 1) / kChunkRows);
  for_each_task(chunks.size(), [&](std::size_t chunk) {
    Chunk summary;
    visit_chunk(points, chunk, [&](std::size_t, const auto& x) {
      ++summary.finite;
      for (std::size_t c = 0; c < x.size(); ++c) summary.sum[c] += static_cast<double>(x[c]);
    });
    chunks[chunk] = summary;
  });

  // The mean lies where most points are: one stray point far away must not cost the others their precision.
  finite_ = 0;
  centre_ = {};
  for (Chunk& chunk : chunks) {
    chunk.start = finite_;
    finite_ += chunk.finite;
  }
  for (const Chunk& chunk : chunks) {
    for (std::size_t c = 0; c < kMaxDimension; ++c) centre_[c] += chunk.sum[c] / static_cast<double>(finite_ > 0 ? finite_ : 1);
  }
  keep_finite(points, chunks);
  if (dimension_ <= 3 && all_.blocks >= kSortedBlocks && !points.ordered) sort();
  all_.caps.assign(all_.blocks * kBlockPoints, 0.0F);  // after the sort, whose memory is free again
}

void PointStore::keep_finite(const PointsView& points, std::vector<Chunk>& chunks) {
  all_.points = finite_;
  all_.blocks = (finite_ + kBlockPoints - 1) / kBlockPoints;
  const std::size_t padded = all_.blocks * kBlockPoints;
  const auto width = static_cast<std::size_t>(dimension_);
  for (std::size_t c = 0; c < kMaxDimension; ++c) all_.columns[c].resize(c < width ? padded : 0);
  input_.resize(finite_ == count_ ? 0 : finite_);
  for_each_task(chunks.size(), [&](std::size_t chunk) {
    std::size_t position = chunks[chunk].start;
    std::array<float, kMaxDimension> reach{};
    std::array<float*, kMaxDimension> columns{};
    for (std::size_t c = 0; c < width; ++c) columns[c] = all_.columns[c].data();
    std::uint32_t* const input = input_.empty() ? nullptr : input_.data();
    visit_chunk(points, chunk, [&](std::size_t row, const auto& x) {
      for (std::size_t c = 0; c < x.size(); ++c) {
        const auto centred = static_cast<float>(static_cast<double>(x[c]) - centre_[c]);
        columns[c][position] = centred;
        reach[c] = std::max(reach[c], std::abs(centred));
      }
      if (input != nullptr) input[position] = static_cast<std::uint32_t>(row);
      ++position;
    });
    chunks[chunk].reach = reach;
  });
  reach_ = {};
  for (const Chunk& chunk : chunks) {
    for (std::size_t c = 0; c < width; ++c) reach_[c] = std::max(reach_[c], chunk.reach[c]);
  }
  for (std::size_t c = 0; c < width; ++c)
    std::fill(all_.columns[c].begin() + static_cast<std::ptrdiff_t>(finite_), all_.columns[c].end(), 0.0F);
}

void PointStore::sort() {
  const auto width = static_cast<std::size_t>(dimension_);
  std::array<const float*, kMaxDimension> columns{};
  for (std::size_t c = 0; c < width; ++c) columns[c] = all_.columns[c].data();
  morton_.sort(std::span(columns).first(width), finite_, order_);
  const auto each = [&](auto&& body) {
    for_each_task((finite_ + kChunkRows - 1) / kChunkRows, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kChunkRows; i < std::min(finite_, (chunk + 1) * kChunkRows); ++i) body(i);
    });
  };
  for (std::size_t c = 0; c < width; ++c) {
    unsorted_.resize(all_.columns[c].size());
    unsorted_.swap(all_.columns[c]);
    std::fill(all_.columns[c].begin() + static_cast<std::ptrdiff_t>(finite_), all_.columns[c].end(), 0.0F);
    each([&](std::size_t i) { all_.columns[c][i] = unsorted_[order_[i]]; });
  }
  if (!input_.empty()) each([&](std::size_t i) { order_[i] = input_[order_[i]]; });
  input_.swap(order_);
  if (finite_ > kLarge) {
    Aligned<float>().swap(unsorted_);
    std::vector<std::uint32_t>().swap(order_);
  }
}

std::optional<std::size_t> PointStore::bad_cap(std::span<const float> caps) const noexcept {
  const auto good = [](float cap) { return cap >= 0 && cap <= std::numeric_limits<float>::max(); };
  if (input_.empty()) {
    int bad = 0;
#pragma omp simd reduction(+ : bad)
    for (std::size_t i = 0; i < finite_; ++i) bad += good(caps[i]) ? 0 : 1;
    if (bad == 0) return std::nullopt;
  }
  for (std::size_t i = 0; i < finite_; ++i) {
    if (!good(caps[input_index(i)])) return input_index(i);
  }
  return std::nullopt;
}

void PointStore::set_caps(std::span<const float> caps) {
  bounds_current_ = false;
  Reused<float> most((finite_ + kChunkRows - 1) / kChunkRows);
  Reused<std::size_t> costly(most.size());
  for_each_task(most.size(), [&](std::size_t chunk) {
    const std::size_t first = chunk * kChunkRows, last = std::min(finite_, first + kChunkRows);
    float* const kept = all_.caps.data();
    if (input_.empty()) {
      std::copy(caps.begin() + static_cast<std::ptrdiff_t>(first), caps.begin() + static_cast<std::ptrdiff_t>(last), kept + first);
    } else {
      for (std::size_t i = first; i < last; ++i) kept[i] = caps[input_[i]];
    }
    float most_here = 0;
    std::uint32_t costly_here = 0;
#pragma omp simd reduction(max : most_here) reduction(+ : costly_here)
    for (std::size_t i = first; i < last; ++i) {
      most_here = std::max(most_here, kept[i]);
      costly_here += kept[i] > 0 ? 1U : 0U;
    }
    most[chunk] = most_here;
    costly[chunk] = costly_here;
  });
  most_cap_ = most.empty() ? 0.0F : *std::max_element(most.begin(), most.end());
  costly_.points = std::accumulate(costly.begin(), costly.end(), std::size_t{0});
  apart_ = finite_ <= kLarge && static_cast<double>(costly_.points) < kMostCostly * static_cast<double>(finite_);
  if (apart_) keep_costly();
}

void PointStore::keep_costly() {
  costly_.blocks = (costly_.points + kBlockPoints - 1) / kBlockPoints;
  const auto width = static_cast<std::size_t>(dimension_);
  const std::size_t padded = costly_.blocks * kBlockPoints;
  places_.resize(costly_.points + 1);  // what is written to the last is not kept
  const float* const caps = all_.caps.data();
  std::size_t at = 0;
  for (std::uint32_t i = 0; i < finite_; ++i) {
    places_[at] = i;
    at += caps[i] > 0 ? 1 : 0;
  }
  const auto take = [&](const Aligned<float>& from, Aligned<float>& to) {
    to.resize(padded);
    for (std::size_t k = 0; k < costly_.points; ++k) to[k] = from[places_[k]];
    std::fill(to.begin() + static_cast<std::ptrdiff_t>(costly_.points), to.end(), 0.0F);
  };
  take(all_.caps, costly_.caps);
  for (std::size_t c = 0; c < width; ++c) take(all_.columns[c], costly_.columns[c]);
}

Summing PointStore::summing(Loss loss) const noexcept {
  // Caps much larger than the cloud truncate nothing, and their quanta would be coarse against the distances.
  constexpr double kMostCapsPerReach = 4;
  constexpr double kQuantaPerLoss = static_cast<double>(std::int64_t{1} << 27) / static_cast<double>(kBlockPoints);
  double square = 0;
  for (const float r : reach_) square += static_cast<double>(r) * static_cast<double>(r);
  const double cap = static_cast<double>(most_cap_);
  const double limit = loss == Loss::truncated_l1 ? cap : cap * cap;
  if (limit == 0) return {loss, 1.0F};
  const double scale = std::exp2(std::floor(std::log2(kQuantaPerLoss / limit)));
  const bool coarse = cap > kMostCapsPerReach * std::sqrt(square);
  const bool representable = scale > 1e-30 && scale < 1e30;
  return {loss, coarse || !representable ? 0.0F : static_cast<float>(scale)};
}

void PointStore::prepare_bounds(const CpuKernels& kernels, const Summing& summing) {
  if (bounds_current_ && bounds_summing_.loss == summing.loss && bounds_summing_.scale == summing.scale) return;
  bounds_.resize(costly_tiles());
  for_each_task(costly_tiles(), [&](std::size_t index) {
    const TileView view = costly_tile(index);
    TileBounds& bounds = bounds_[index];
    for (std::size_t block = 0; block < kTileBlocks; ++block) {
      BlockBounds one;
      if (block < view.blocks) {
        std::array<const float*, kMaxDimension> columns{};
        for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) columns[c] = view.columns[c] + block * kBlockPoints;
        kernels.bound_block(columns.data(), view.caps + block * kBlockPoints, dimension_, one);
      }
      pack_bounds(one, block, bounds);
      bounds.cap_units[block] = 0;
    }
    kernels.cap_units(summing, view, bounds.cap_units);
    wrap_bounds(dimension_, bounds);
  });
  bounds_current_ = true;
  bounds_summing_ = summing;
}

void PointStore::take_sides(const CpuKernels& kernels, ModelKind kind, const float* coefficients) {
  for_each_task(costly_tiles(), [&](std::size_t index) { kernels.take_sides(kind, costly_tile(index), coefficients, bounds_[index]); });
}

TileView Columns::tile(int dimension, std::size_t index) const noexcept {
  TileView view;
  const std::size_t first = index * kTilePoints;
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) view.columns[c] = columns[c].data() + first;
  view.caps = caps.data() + first;
  view.blocks = std::min(kTileBlocks, blocks - index * kTileBlocks);
  return view;
}

void pack_bounds(const BlockBounds& block, std::size_t at, TileBounds& tile) {
  tile.field[Field::count][at] = block.count;
  tile.field[Field::least_cap][at] = block.least_cap;
  tile.field[Field::most_cap][at] = block.most_cap;
  tile.field[Field::cap_sum][at] = block.cap_sum;
  tile.field[Field::radius][at] = block.radius;
  tile.field[Field::mean_square][at] = block.mean_square;
  tile.field[Field::side_sum][at] = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    tile.field[Field::mean + c][at] = block.mean[c];
    tile.field[Field::spread + c][at] = block.spread[c];
    tile.field[Field::sign_sum + c][at] = block.sign_sum[c];
    tile.field[Field::side_offset + c][at] = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      tile.field[Field::axis + 3 * e + c][at] = block.axis[e][c];
      tile.field[Field::signed_offset + 3 * e + c][at] = block.signed_offset[e][c];
    }
  }
}

void wrap_bounds(int dimension, TileBounds& tile) {
  const auto width = static_cast<std::size_t>(dimension);
  tile.all_cap_units = std::accumulate(tile.cap_units, tile.cap_units + kTileBlocks, std::int64_t{0});
  tile.ball_cap = *std::max_element(tile.field[Field::most_cap], tile.field[Field::most_cap] + kTileBlocks);
  double count = 0;
  std::array<double, kMaxDimension> mean{};
  for (std::size_t block = 0; block < kTileBlocks; ++block) {
    const auto here = static_cast<double>(tile.field[Field::count][block]);
    count += here;
    for (std::size_t c = 0; c < width; ++c) mean[c] += here * static_cast<double>(tile.field[Field::mean + c][block]);
  }
  for (std::size_t c = 0; c < width; ++c) tile.ball[c] = count > 0 ? static_cast<float>(mean[c] / count) : 0.0F;
  double radius = 0;
  for (std::size_t block = 0; block < kTileBlocks; ++block) {
    if (tile.field[Field::count][block] == 0) continue;
    double square = 0;
    for (std::size_t c = 0; c < width; ++c) {
      const double way = static_cast<double>(tile.field[Field::mean + c][block]) - static_cast<double>(tile.ball[c]);
      square += way * way;
    }
    radius = std::max(radius, std::sqrt(square) + static_cast<double>(tile.field[Field::radius][block]));
  }
  tile.ball_radius = static_cast<float>(radius * (1 + 1e-5));
}

}  // namespace swarmfit::kernels::cpu
