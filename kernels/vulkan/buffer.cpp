#include "kernels/vulkan/buffer.hpp"

#include <array>
#include <stdexcept>

namespace swarmfit::kernels::vulkan {
namespace {

using Property = vk::MemoryPropertyFlagBits;

/// What a residence needs, best first.
std::array<vk::MemoryPropertyFlags, 2> wishes(Residence residence) {
  const vk::MemoryPropertyFlags host = Property::eHostVisible | Property::eHostCoherent;
  switch (residence) {
    case Residence::device: return {Property::eDeviceLocal, vk::MemoryPropertyFlags()};
    case Residence::upload: return {host | Property::eDeviceLocal, host};
    case Residence::readback: break;
  }
  return {host | Property::eHostCached, host};
}

std::uint32_t memory_type(const vk::PhysicalDeviceMemoryProperties& memory, std::uint32_t allowed, Residence residence) {
  for (const vk::MemoryPropertyFlags wish : wishes(residence)) {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
      if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & wish) == wish) return i;
    }
  }
  throw std::runtime_error("no memory of the device fits a storage buffer");
}

vk::BufferUsageFlags usage(const DeviceTraits& device) {
  using Usage = vk::BufferUsageFlagBits;
  const vk::BufferUsageFlags storage = Usage::eStorageBuffer | Usage::eTransferDst | Usage::eTransferSrc | Usage::eIndirectBuffer;
  return device.texels ? storage | Usage::eUniformTexelBuffer : storage;
}

}  // namespace

Buffer::Buffer(const Device& device, std::size_t bytes, Residence residence)
    : bytes_(bytes), buffer_(device.handle(), vk::BufferCreateInfo({}, bytes, usage(device.traits()))) {
  const vk::MemoryRequirements needs = buffer_.getMemoryRequirements();
  const std::uint32_t type = memory_type(device.memory(), needs.memoryTypeBits, residence);
  memory_ = vk::raii::DeviceMemory(device.handle(), vk::MemoryAllocateInfo(needs.size, type));
  buffer_.bindMemory(*memory_, 0);
  if (device.traits().texels) {
    texels_ =
        vk::raii::BufferView(device.handle(), vk::BufferViewCreateInfo({}, *buffer_, vk::Format::eR32G32B32A32Sfloat, 0, VK_WHOLE_SIZE));
  }
  if (residence == Residence::device && device.traits().staging) return;
  const vk::MemoryPropertyFlags host = Property::eHostVisible | Property::eHostCoherent;
  if ((device.memory().memoryTypes[type].propertyFlags & host) == host) mapped_ = memory_.mapMemory(0, VK_WHOLE_SIZE);
}

bool Buffer::reserve(const Device& device, std::size_t bytes, Residence residence) {
  if (bytes <= bytes_) return false;
  *this = Buffer();  // the old memory goes first: both may not fit
  *this = Buffer(device, bytes, residence);
  return true;
}

}  // namespace swarmfit::kernels::vulkan
