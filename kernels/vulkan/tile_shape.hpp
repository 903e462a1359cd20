// How a workload is cut for a device.
#pragma once

#include <cstdint>

#include "kernels/vulkan/device.hpp"

namespace swarmfit::kernels::vulkan {

/// How the points are cut; depends on the cloud alone, so that a particle's cost does not depend on its swarm.
struct ChunkShape {
  std::uint32_t group = 0;  ///< invocations in a group
  std::uint32_t work = 0;   ///< quads an invocation goes through
  std::uint32_t sums = 0;   ///< partial sums a group leaves of each particle
  std::uint32_t points() const noexcept { return group * work * 4; }
};
ChunkShape chunk_shape(const DeviceTraits& device, std::size_t points, int dimension);

/// How the particles, of so many coefficients each, are cut: into `tiles` of `tile` each, the last one padded.
struct TileShape {
  std::uint32_t tile = 0;
  std::uint32_t tiles = 0;
  std::uint32_t padded() const noexcept { return tile * tiles; }
};
TileShape tile_shape(const DeviceTraits& device, std::size_t particles, int coefficients);

/// Particles that a group looks at in a pruned swarm, of which the open ones fill tiles: a multiple of 32.
std::uint32_t span_shape(std::size_t particles);

/// Invocations of a group that adds up one particle's partial sums; a cost depends on it.
std::uint32_t reduce_group(const DeviceTraits& device);

/// Particles a tile may have at most; smaller ones divide it.
std::uint32_t largest_tile(const DeviceTraits& device);

}  // namespace swarmfit::kernels::vulkan
