// A storage buffer with its own memory.
#pragma once

#include <cstddef>
#include <span>

#include "kernels/vulkan/device.hpp"

namespace swarmfit::kernels::vulkan {

enum class Residence {
  device,    ///< read and written by shaders; mapped too where the device's memory is the host's
  upload,    ///< written by the host each time, read by shaders
  readback,  ///< written by shaders, read by the host
};

class Buffer {
 public:
  Buffer() = default;
  /// Throws std::exception. `bytes` >= 1.
  Buffer(const Device& device, std::size_t bytes, Residence residence);

  /// Makes it at least `bytes` large; what it held is lost if it had to grow. Returns whether it did.
  bool reserve(const Device& device, std::size_t bytes, Residence residence);

  std::size_t bytes() const noexcept { return bytes_; }
  vk::Buffer handle() const noexcept { return *buffer_; }
  /// All of it as a texel buffer, four floats a texel; null where the device does not read through texels.
  vk::BufferView texels() const noexcept { return *texels_; }
  /// Persistently mapped, coherent; null where the host cannot see it.
  void* mapped() const noexcept { return mapped_; }

  template <class T>
  std::span<T> as() const noexcept {
    return {static_cast<T*>(mapped_), mapped_ ? bytes_ / sizeof(T) : 0};
  }

 private:
  std::size_t bytes_ = 0;
  vk::raii::DeviceMemory memory_{nullptr};
  vk::raii::Buffer buffer_{nullptr};
  vk::raii::BufferView texels_{nullptr};
  void* mapped_ = nullptr;
};

}  // namespace swarmfit::kernels::vulkan
