#include "kernels/vulkan/tile_shape.hpp"

#include <algorithm>
#include <bit>

namespace swarmfit::kernels::vulkan {
namespace {

constexpr std::uint32_t kLeastSpan = 64, kMostSpan = 256;  // with more, a few chunks would give too few groups

std::uint32_t ceil_div(std::size_t a, std::size_t b) { return static_cast<std::uint32_t>((a + b - 1) / b); }

}  // namespace

// A software device runs a subgroup as one SIMD register and pays dearly for every load, so one load must serve many particles,
// and a chunk must be long to make up for filling the tile. A GPU wants many groups, each light on registers. Full tiles are those of kinds
// with four coefficients; others hold no more coefficients than that, but four particles at least.
std::uint32_t largest_tile(const DeviceTraits& device) { return device.software ? 32 : 16; }

std::uint32_t reduce_group(const DeviceTraits& device) { return device.software ? device.subgroup : std::min(64U, device.group_limit); }

ChunkShape chunk_shape(const DeviceTraits& device, std::size_t points, int dimension) {
  ChunkShape shape;
  const std::uint32_t wanted_group = device.software ? device.subgroup : std::max<std::uint32_t>(128, device.subgroup);
  shape.group = std::bit_floor(std::min(wanted_group, device.group_limit));
  const std::uint32_t most_work = device.software ? 64 : 8;
  const std::size_t wanted_chunks = device.software ? 16 : 512;
  const std::size_t work = points / (wanted_chunks * shape.group * 4);
  shape.work = static_cast<std::uint32_t>(std::bit_floor(std::clamp<std::size_t>(work, 1, most_work)));
  const std::size_t columns = device.storage_range / (sizeof(float) * static_cast<std::size_t>(dimension));
  shape.sums = device.texels ? shape.group : 1;
  while (shape.work > 1 && shape.points() > columns) shape.work /= 2;
  return shape;
}

std::uint32_t span_shape(std::size_t particles) { return std::clamp<std::uint32_t>(ceil_div(particles, 32) * 32, kLeastSpan, kMostSpan); }

TileShape tile_shape(const DeviceTraits& device, std::size_t particles, int coefficients) {
  TileShape shape;
  const std::uint32_t registers = 4 * largest_tile(device);
  const std::uint32_t most = std::clamp(std::bit_floor(registers / static_cast<std::uint32_t>(coefficients)), 4U, largest_tile(device));
  shape.tiles = std::max(1U, ceil_div(particles, most));
  // Even tiles, in steps of 4 so that few pipelines are needed, waste little of the last one.
  shape.tile = std::min(most, (ceil_div(particles, shape.tiles) + 3) / 4 * 4);
  shape.tile = std::max(shape.tile, 4U);
  shape.tiles = std::max(1U, ceil_div(particles, shape.tile));
  return shape;
}

}  // namespace swarmfit::kernels::vulkan
