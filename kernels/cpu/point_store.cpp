#include "kernels/cpu/point_store.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <oneapi/tbb/parallel_for.h>

namespace swarmfit::kernels::cpu {
namespace {

/// Rows a task reads. Fixed, so that the centre does not depend on the number of threads.
constexpr std::size_t kChunkRows = 16384;

struct ChunkSummary {
  std::size_t finite = 0;
  std::array<double, kMaxDimension> sum{};
};

/// Calls visit(row, values) for each finite row in [first, last), with `values` its columns as double.
template <class S, class Visit>
void visit_finite(const PointsView& points, std::size_t first, std::size_t last, Visit&& visit) {
  const char* row_data = static_cast<const char*>(points.data) + first * points.stride;
  const auto columns = static_cast<std::size_t>(points.dimension);
  for (std::size_t row = first; row < last; ++row, row_data += points.stride) {
    std::array<S, kMaxDimension> raw{};
    std::memcpy(raw.data(), row_data, columns * sizeof(S));
    std::array<double, kMaxDimension> values;
    bool finite = true;
    for (std::size_t c = 0; c < kMaxDimension; ++c) {
      values[c] = static_cast<double>(raw[c]);
      finite = finite && std::isfinite(raw[c]);
    }
    if (finite) visit(row, values);
  }
}

template <class Visit>
void visit_chunk(const PointsView& points, std::size_t chunk, Visit&& visit) {
  const std::size_t first = chunk * kChunkRows;
  const std::size_t last = std::min(points.count, first + kChunkRows);
  if (points.scalar == Scalar::float32) return visit_finite<float>(points, first, last, visit);
  visit_finite<double>(points, first, last, visit);
}

}  // namespace

void PointStore::assign(const PointsView& points) {
  dimension_ = points.dimension;
  count_ = points.count;
  const std::size_t chunks = (count_ + kChunkRows - 1) / kChunkRows;
  std::vector<ChunkSummary> summaries(chunks);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    ChunkSummary summary;
    visit_chunk(points, chunk, [&](std::size_t, const std::array<double, kMaxDimension>& x) {
      ++summary.finite;
      for (std::size_t c = 0; c < kMaxDimension; ++c) summary.sum[c] += x[c];
    });
    summaries[chunk] = summary;
  });

  // The mean lies where most points are: one stray point far away must not cost the others their precision.
  std::vector<std::size_t> starts(chunks);
  finite_ = 0;
  centre_ = {};
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    starts[chunk] = finite_;
    finite_ += summaries[chunk].finite;
  }
  for (const ChunkSummary& summary : summaries) {
    for (std::size_t c = 0; c < kMaxDimension; ++c) centre_[c] += summary.sum[c] / static_cast<double>(finite_ > 0 ? finite_ : 1);
  }

  blocks_ = (finite_ + kBlockPoints - 1) / kBlockPoints;
  const std::size_t padded = blocks_ * kBlockPoints;
  const auto width = static_cast<std::size_t>(dimension_);
  for (std::size_t c = 0; c < kMaxDimension; ++c) columns_[c].resize(c < width ? padded : 0);
  caps_.assign(padded, 0.0F);
  input_.resize(finite_ == count_ ? 0 : finite_);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    std::size_t position = starts[chunk];
    visit_chunk(points, chunk, [&](std::size_t row, const std::array<double, kMaxDimension>& x) {
      for (std::size_t c = 0; c < width; ++c) columns_[c][position] = static_cast<float>(x[c] - centre_[c]);
      if (!input_.empty()) input_[position] = static_cast<std::uint32_t>(row);
      ++position;
    });
  });
  for (std::size_t c = 0; c < width; ++c) std::fill(columns_[c].begin() + static_cast<std::ptrdiff_t>(finite_), columns_[c].end(), 0.0F);
}

void PointStore::set_caps(std::span<const float> caps) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, finite_, kChunkRows), [&](const tbb::blocked_range<std::size_t>& range) {
    if (input_.empty()) {
      std::copy(caps.begin() + static_cast<std::ptrdiff_t>(range.begin()), caps.begin() + static_cast<std::ptrdiff_t>(range.end()),
                caps_.begin() + static_cast<std::ptrdiff_t>(range.begin()));
    } else {
      for (std::size_t i = range.begin(); i < range.end(); ++i) caps_[i] = caps[input_[i]];
    }
  });
}

TileView PointStore::tile(std::size_t index) const noexcept {
  TileView view;
  const std::size_t first = index * kTilePoints;
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c) view.columns[c] = columns_[c].data() + first;
  view.caps = caps_.data() + first;
  view.blocks = std::min(kTileBlocks, blocks_ - index * kTileBlocks);
  return view;
}

}  // namespace swarmfit::kernels::cpu
