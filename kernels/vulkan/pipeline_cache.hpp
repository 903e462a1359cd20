// A Vulkan pipeline cache kept on disk, one file a device and driver.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "kernels/vulkan/device.hpp"

namespace swarmfit::kernels::vulkan {

/// A file holds our own header (magic, size, checksum), then the driver's data, which must open with the header that Vulkan
/// prescribes for this device. A file that is damaged or another device's is passed over and replaced.
class PipelineCache {
 public:
  /// An empty `folder` keeps nothing on disk. Throws std::exception only for what Vulkan itself refuses.
  PipelineCache(const Device& device, const std::filesystem::path& folder);

  const vk::raii::PipelineCache& handle() const noexcept { return cache_; }
  /// Writes what the driver holds, to a file beside the final one and then in its place. What fails is let be: a cache is a convenience.
  void save() const noexcept;

 private:
  std::filesystem::path file_;
  vk::raii::PipelineCache cache_;
};

/// The payload of a cache file's bytes, empty where the file is damaged. Apart from Vulkan, for tests.
std::vector<std::uint8_t> unwrap_cache(const std::vector<std::uint8_t>& file);
std::vector<std::uint8_t> wrap_cache(const std::vector<std::uint8_t>& payload);

}  // namespace swarmfit::kernels::vulkan
