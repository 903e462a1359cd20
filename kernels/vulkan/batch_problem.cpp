#include "kernels/vulkan/batch_problem.hpp"

#include <algorithm>

namespace swarmfit::kernels::vulkan {

void BatchProblem::set_points(const DeviceTraits& device, const PointsView& points) {
  usable_ = false;
  Extent extent = measure(points);
  const ChunkShape shape = chunk_shape(device, extent.finite_count, points.dimension);
  points_.set(points, std::move(extent), shape);
  chunks_ = static_cast<std::uint32_t>((points_.count() + shape.points() - 1) / shape.points());
  values_.assign(caps_from() + stride(), 0.0F);
  for (std::size_t c = 0; c < static_cast<std::size_t>(points.dimension); ++c) {
    const std::span<const float> column = points_.column(c);
    std::copy(column.begin(), column.end(), values_.begin() + static_cast<std::ptrdiff_t>(c * stride()));
  }
  new_points_ = true;
  effort = {};
  usable_ = true;
}

void BatchProblem::set_caps(std::span<const float> caps) {
  const std::span<float> own = std::span(values_).subspan(caps_from());
  for (std::size_t i = 0; i < points_.count(); ++i) own[i] = caps[points_.row(i)];
  new_caps_ = true;
}

void BatchProblem::settle(std::size_t place, std::size_t room) noexcept {
  place_ = place;
  room_ = room;
  new_points_ = true;
}

void BatchProblem::write(std::span<float> device) {
  if (!new_points_ && !new_caps_) return;
  const std::size_t first = new_points_ ? 0 : caps_from();
  const std::span<const float> fresh = std::span(values_).subspan(first);
  std::copy(fresh.begin(), fresh.end(), device.begin() + static_cast<std::ptrdiff_t>(place_ + first));
  new_points_ = new_caps_ = false;
}

}  // namespace swarmfit::kernels::vulkan
