#include "kernels/vulkan/instance.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include "kernels/vulkan/guarded.hpp"

namespace swarmfit::kernels {
namespace vulkan {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

bool has_layer(const vk::raii::Context& context, std::string_view wanted) {
  const auto layers = context.enumerateInstanceLayerProperties();
  return std::any_of(layers.begin(), layers.end(), [&](const vk::LayerProperties& layer) { return layer.layerName.data() == wanted; });
}

VKAPI_ATTR VkBool32 VKAPI_CALL pass_on(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* listener) {
  (*static_cast<std::function<void(std::string_view)>*>(listener))(data->pMessage);
  return VK_FALSE;
}

vk::raii::Instance create(const vk::raii::Context& context, bool validation) {
  const vk::ApplicationInfo application("swarmfit", 0, "swarmfit", 0, VK_API_VERSION_1_1);
  if (!validation) return vk::raii::Instance(context, vk::InstanceCreateInfo({}, &application));
  if (!has_layer(context, kValidationLayer)) {
    throw std::runtime_error(fmt::format("validation was asked for, but the layer {} is not installed", kValidationLayer));
  }
  const std::array layers{kValidationLayer};
  const std::array extensions{VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
  const std::array enabled{vk::ValidationFeatureEnableEXT::eSynchronizationValidation};
  const vk::ValidationFeaturesEXT features(enabled);
  return vk::raii::Instance(context, vk::InstanceCreateInfo({}, &application, layers, extensions, &features));
}

int rank(vk::PhysicalDeviceType type) noexcept {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu: return 0;
    case vk::PhysicalDeviceType::eIntegratedGpu: return 1;
    case vk::PhysicalDeviceType::eVirtualGpu: return 2;
    case vk::PhysicalDeviceType::eCpu: return 3;
    default: return 4;
  }
}

}  // namespace

Instance::Instance(const EvaluatorOptions& options)
    : on_validation_(std::make_unique<std::function<void(std::string_view)>>(options.on_validation)),
      instance_(create(context_, options.validation)),
      messenger_(nullptr) {
  if (options.validation && *on_validation_) listen();
}

void Instance::listen() {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  messenger_ = instance_.createDebugUtilsMessengerEXT(vk::DebugUtilsMessengerCreateInfoEXT(
      {}, Severity::eError | Severity::eWarning, Type::eGeneral | Type::eValidation | Type::ePerformance, pass_on, on_validation_.get()));
}

std::vector<vk::raii::PhysicalDevice> Instance::devices() const {
  auto found = vk::raii::PhysicalDevices(instance_);
  std::vector<vk::raii::PhysicalDevice> all(std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
  std::stable_sort(all.begin(), all.end(), [](const vk::raii::PhysicalDevice& a, const vk::raii::PhysicalDevice& b) {
    return rank(a.getProperties().deviceType) < rank(b.getProperties().deviceType);
  });
  return all;
}

const char* kind_name(vk::PhysicalDeviceType type) noexcept {
  constexpr const char* kNames[] = {"discrete GPU", "integrated GPU", "virtual GPU", "software", "other"};
  return kNames[rank(type)];
}

int compute_family(const vk::raii::PhysicalDevice& device) {
  const auto families = device.getQueueFamilyProperties();
  int found = -1;
  for (std::size_t i = 0; i < families.size(); ++i) {
    if (!(families[i].queueFlags & vk::QueueFlagBits::eCompute)) continue;
    if (!(families[i].queueFlags & vk::QueueFlagBits::eGraphics)) return static_cast<int>(i);
    if (found < 0) found = static_cast<int>(i);
  }
  return found;
}

std::string obstacle(const vk::raii::PhysicalDevice& device) {
  const std::uint32_t version = device.getProperties().apiVersion;
  if (version < VK_API_VERSION_1_1) {
    return fmt::format("speaks Vulkan {}.{}, must be >= 1.1", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version));
  }
  if (compute_family(device) < 0) return "has no queue that computes";
  return {};
}

Result<Opened> open_device(const EvaluatorOptions& options, std::string_view name) {
  constexpr std::size_t kSmallestRange = 16384;  // a tile of particles and a chunk of points on any device
  if (options.max_storage_range > 0 && options.max_storage_range < kSmallestRange) {
    return fail(Failure::Kind::invalid,
                fmt::format("max_storage_range is {}, must be 0 or >= {}", options.max_storage_range, kSmallestRange));
  }
  Instance instance(options);
  std::string seen;
  for (vk::raii::PhysicalDevice& device : instance.devices()) {
    const std::string device_name = device.getProperties().deviceName.data();
    const std::string why = obstacle(device);
    if (why.empty() && (name.empty() || contains_ignoring_case(device_name, name))) return Opened{std::move(instance), std::move(device)};
    seen += fmt::format("{}{}{}", seen.empty() ? "" : ", ", device_name, why.empty() ? "" : " (" + why + ")");
  }
  if (seen.empty()) seen = "none";
  return fail(Failure::Kind::unavailable, name.empty() ? fmt::format("backend is 'vulkan', but no device can be used; there are: {}", seen)
                                                       : fmt::format("vulkan device is '{}', must be one of: {}", name, seen));
}

DeviceDescription describe(const vk::raii::PhysicalDevice& device) {
  const auto chain = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceSubgroupProperties>();
  const vk::PhysicalDeviceProperties& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
  vk::DeviceSize memory = 0;
  const auto heaps = device.getMemoryProperties();
  for (std::uint32_t i = 0; i < heaps.memoryHeapCount; ++i) {
    if (heaps.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal) memory = std::max(memory, heaps.memoryHeaps[i].size);
  }
  DeviceDescription description;
  description.backend = "vulkan";
  description.device = properties.deviceName.data();
  description.kind = kind_name(properties.deviceType);
  description.reason = obstacle(device);
  description.usable = description.reason.empty();
  if (description.usable) {
    description.reason =
        properties.deviceType == vk::PhysicalDeviceType::eCpu ? "software: by name only, auto passes it over" : "auto takes it";
  }
  const std::uint32_t version = properties.apiVersion;
  description.limits = {
      {"vulkan", fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version), VK_API_VERSION_PATCH(version))},
      {"memory_bytes", fmt::format("{}", memory)},
      {"storage_range_bytes", fmt::format("{}", properties.limits.maxStorageBufferRange)},
      {"subgroup_size", fmt::format("{}", chain.get<vk::PhysicalDeviceSubgroupProperties>().subgroupSize)},
      {"group_invocations", fmt::format("{}", properties.limits.maxComputeWorkGroupInvocations)},
      {"group_memory_bytes", fmt::format("{}", properties.limits.maxComputeSharedMemorySize)},
  };
  return description;
}

}  // namespace vulkan

std::vector<DeviceDescription> vulkan_devices() {
  const auto listed = vulkan::guarded("listing devices", Failure::Kind::unavailable, []() -> Result<std::vector<DeviceDescription>> {
    const vulkan::Instance instance{EvaluatorOptions{}};
    std::vector<DeviceDescription> all;
    for (const vk::raii::PhysicalDevice& device : instance.devices()) all.push_back(vulkan::describe(device));
    if (all.empty()) return fail(Failure::Kind::unavailable, "vulkan: the loader finds no device");
    return all;
  });
  if (listed) return *listed;
  return {{"vulkan", "none", "none", false, listed.error().message, {}}};
}

}  // namespace swarmfit::kernels
