#include "kernels/vulkan/chunk_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/blocks.hpp"
#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

float rounded_up(double value) { return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity()); }

}  // namespace

void ChunkBounds::set_points(const ChunkShape& shape, const Columns& columns, int dimension) {
  shape_ = shape;
  count_ = columns[0].size();
  chunks_ = (count_ + shape.points() - 1) / shape.points();
  stride_ = static_cast<std::uint32_t>((chunks_ + layout::kQuad - 1) / layout::kQuad * layout::kQuad);
  values_.assign(layout::kBoundColumns * std::size_t{stride_} + 2 * chunks_ * shape.sums, 0.0F);
  for (std::size_t chunk = 0; chunk < chunks_; ++chunk) bound(columns, dimension, chunk);
}

void ChunkBounds::bound(const Columns& columns, int dimension, std::size_t chunk) {
  const auto width = static_cast<std::size_t>(dimension);
  const std::size_t first = chunk * shape_.points(), last = std::min<std::size_t>(count_, first + shape_.points());
  const double share = 1.0 / static_cast<double>(last - first);
  for (std::size_t c = 0; c < width; ++c) {
    double sum = 0;
    for (std::size_t i = first; i < last; ++i) sum += static_cast<double>(columns[c][i]);
    at(c, chunk) = static_cast<float>(sum * share);
  }
  // About the mean as it is told, which float has rounded.
  const auto each_offset = [&](auto&& visit) {
    for (std::size_t i = first; i < last; ++i) {
      std::array<double, 3> offset{};
      for (std::size_t c = 0; c < width; ++c) offset[c] = static_cast<double>(columns[c][i]) - static_cast<double>(at(c, chunk));
      visit(offset);
    }
  };
  Matrix covariance{}, axes{};
  double square = 0;
  each_offset([&](const std::array<double, 3>& offset) {
    square = std::max(square, offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) covariance[a][b] += share * offset[a] * offset[b];
    }
  });
  at(layout::kBoundRadius, chunk) = rounded_up(std::sqrt(square));
  principal_axes(covariance, axes, dimension);
  std::array<double, 3> extent{};
  each_offset([&](const std::array<double, 3>& offset) {
    for (std::size_t e = 0; e < width; ++e) {
      double along = 0;
      for (std::size_t c = 0; c < width; ++c) along += axes[c][e] * offset[c];
      extent[e] = std::max(extent[e], std::abs(along));
    }
  });
  // Axes are unit and across each other to double's last places only, and go as floats.
  constexpr double kRoom = 1.0 + 1e-5;
  for (std::size_t e = 0; e < width; ++e) {
    for (std::size_t c = 0; c < width; ++c) {
      at(layout::kBoundAxes + width * e + c, chunk) = static_cast<float>(kRoom * extent[e] * axes[c][e]);
    }
  }
}

void ChunkBounds::set_caps(std::span<const float> caps) {
  padded_.resize(shape_.points());
  lanes_.resize(2 * std::size_t{shape_.group});
  for (std::size_t chunk = 0; chunk < chunks_; ++chunk) {
    const std::size_t first = chunk * shape_.points();
    const std::span<const float> own = caps.subspan(first, std::min<std::size_t>(shape_.points(), count_ - first));
    double sum = 0, squares = 0;
    for (const float cap : own) {
      sum += static_cast<double>(cap);
      squares += static_cast<double>(cap) * static_cast<double>(cap);
    }
    at(layout::kBoundMostCap, chunk) = *std::max_element(own.begin(), own.end());
    at(layout::kBoundCapSum, chunk) = static_cast<float>(sum);
    at(layout::kBoundCapSum + 1, chunk) = static_cast<float>(squares);
    add_up(chunk, own);
  }
}

/// In the order of cost.comp, to the last bit.
void ChunkBounds::add_up(std::size_t chunk, std::span<const float> caps) {
  std::fill(std::copy(caps.begin(), caps.end(), padded_.begin()), padded_.end(), 0.0F);
  std::fill(lanes_.begin(), lanes_.end(), 0.0F);
  const std::size_t group = shape_.group;
  for (std::size_t quad = 0; quad < padded_.size() / layout::kQuad; ++quad) {
    const float* c = padded_.data() + quad * layout::kQuad;
    lanes_[quad % group] += (c[0] + c[1]) + (c[2] + c[3]);
    lanes_[group + quad % group] += (c[0] * c[0] + c[1] * c[1]) + (c[2] * c[2] + c[3] * c[3]);
  }
  for (std::size_t loss = 0; loss < 2; ++loss) {
    float* const own = lanes_.data() + loss * group;
    for (std::size_t half = shape_.sums == 1 ? group / 2 : 0; half > 0; half /= 2) {
      for (std::size_t lane = 0; lane < half; ++lane) own[lane] += own[lane + half];
    }
    std::copy_n(own, shape_.sums, values_.data() + layout::kBoundColumns * std::size_t{stride_} + (loss * chunks_ + chunk) * shape_.sums);
  }
}

}  // namespace swarmfit::kernels::vulkan
