// A logical device with one compute queue, and the traits that decide how work is cut for it.
#pragma once

#include <cstdint>
#include <string>

#include "kernels/vulkan/instance.hpp"

namespace swarmfit::kernels::vulkan {

struct DeviceTraits {
  std::string name;
  bool software = false;             ///< shaders run on this machine's CPU
  bool texels = false;               ///< reads faster through texel buffers than through storage buffers
  bool staging = false;              ///< device memory is filled through copies even where the host could see it
  std::size_t storage_range = 0;     ///< largest bytes of one storage buffer's binding
  std::size_t allocation_limit = 0;  ///< largest bytes of one allocation
  std::size_t memory = 0;            ///< bytes of the largest device-local heap
  std::uint32_t subgroup = 1;
  std::uint32_t group_limit = 0;     ///< most invocations in a group
  std::uint32_t group_memory = 0;    ///< bytes of shared memory in a group
  std::uint32_t grid_limit[2] = {};  ///< most groups along x, y
};

class Device {
 public:
  /// Throws std::exception.
  Device(const vk::raii::PhysicalDevice& physical, const EvaluatorOptions& options);

  const DeviceTraits& traits() const noexcept { return traits_; }
  const vk::raii::PhysicalDevice& physical() const noexcept { return *physical_; }
  const vk::raii::Device& handle() const noexcept { return device_; }
  const vk::raii::CommandPool& commands() const noexcept { return pool_; }
  const vk::PhysicalDeviceMemoryProperties& memory() const noexcept { return memory_; }

  /// Submits and waits until it is done.
  void run(vk::CommandBuffer commands) const;
  /// Copies from the start of one buffer to the start of another, and waits.
  void copy(vk::Buffer from, vk::Buffer to, std::size_t bytes) const;
  vk::raii::CommandBuffer allocate_commands() const;

 private:
  const vk::raii::PhysicalDevice* physical_;
  DeviceTraits traits_;
  vk::PhysicalDeviceMemoryProperties memory_;
  std::uint32_t family_;
  vk::raii::Device device_;
  vk::raii::Queue queue_;
  vk::raii::CommandPool pool_;
  vk::raii::Fence fence_;
};

}  // namespace swarmfit::kernels::vulkan
