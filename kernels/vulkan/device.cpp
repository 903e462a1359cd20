#include "kernels/vulkan/device.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace swarmfit::kernels::vulkan {
namespace {

DeviceTraits traits_of(const vk::raii::PhysicalDevice& physical, const EvaluatorOptions& options) {
  const auto chain =
      physical
          .getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties, vk::PhysicalDeviceMaintenance3Properties>();
  const vk::PhysicalDeviceProperties& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
  DeviceTraits traits;
  traits.name = properties.deviceName.data();
  traits.software = properties.deviceType == vk::PhysicalDeviceType::eCpu && !options.gpu_paths;
  traits.staging = options.gpu_paths;
  traits.texels = traits.software;
  traits.storage_range = properties.limits.maxStorageBufferRange;
  if (traits.texels) {
    traits.storage_range = std::min(traits.storage_range, std::size_t{properties.limits.maxTexelBufferElements} * 4 * sizeof(float));
  }
  if (options.max_storage_range > 0) traits.storage_range = std::min(traits.storage_range, options.max_storage_range);
  traits.allocation_limit = chain.get<vk::PhysicalDeviceMaintenance3Properties>().maxMemoryAllocationSize;
  traits.subgroup = chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize;
  traits.group_limit = std::min(properties.limits.maxComputeWorkGroupInvocations, properties.limits.maxComputeWorkGroupSize[0]);
  traits.group_memory = properties.limits.maxComputeSharedMemorySize;
  std::copy_n(properties.limits.maxComputeWorkGroupCount.begin(), 2, traits.grid_limit);
  const auto memory = physical.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal) {
      traits.memory = std::max<std::size_t>(traits.memory, memory.memoryHeaps[i].size);
    }
  }
  return traits;
}

vk::raii::Device create(const vk::raii::PhysicalDevice& physical, std::uint32_t family) {
  const float priority = 1.0F;
  const vk::DeviceQueueCreateInfo queue({}, family, 1, &priority);
  return vk::raii::Device(physical, vk::DeviceCreateInfo({}, queue));
}

}  // namespace

Device::Device(const vk::raii::PhysicalDevice& physical, const EvaluatorOptions& options)
    : physical_(&physical),
      traits_(traits_of(physical, options)),
      memory_(physical.getMemoryProperties()),
      family_(static_cast<std::uint32_t>(compute_family(physical))),
      device_(create(physical, family_)),
      queue_(device_, family_, 0),
      pool_(device_, vk::CommandPoolCreateInfo(vk::CommandPoolCreateFlagBits::eResetCommandBuffer, family_)),
      fence_(device_, vk::FenceCreateInfo()) {}

void Device::run(vk::CommandBuffer commands) const {
  queue_.submit(vk::SubmitInfo({}, {}, commands), *fence_);
  if (device_.waitForFences(*fence_, VK_TRUE, std::numeric_limits<std::uint64_t>::max()) != vk::Result::eSuccess) {
    throw std::runtime_error("the device did not answer");
  }
  device_.resetFences(*fence_);
}

vk::raii::CommandBuffer Device::allocate_commands() const {
  vk::raii::CommandBuffers one(device_, vk::CommandBufferAllocateInfo(*pool_, vk::CommandBufferLevel::ePrimary, 1));
  return std::move(one.front());
}

void Device::copy(vk::Buffer from, vk::Buffer to, std::size_t bytes) const {
  const vk::raii::CommandBuffer commands = allocate_commands();
  commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
  commands.copyBuffer(from, to, vk::BufferCopy(0, 0, bytes));
  const vk::MemoryBarrier written(vk::AccessFlagBits::eTransferWrite, vk::AccessFlagBits::eShaderRead);
  commands.pipelineBarrier(vk::PipelineStageFlagBits::eTransfer, vk::PipelineStageFlagBits::eComputeShader, {}, written, {}, {});
  commands.end();
  run(*commands);
}

}  // namespace swarmfit::kernels::vulkan
