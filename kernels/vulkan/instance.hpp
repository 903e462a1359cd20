// The Vulkan instance, its validation, and the devices it shows.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/evaluators.hpp"
#include "kernels/vulkan/vulkan.hpp"

namespace swarmfit::kernels::vulkan {

/// Throws std::exception. With `options.validation` and no validation layer: a message that says so.
class Instance {
 public:
  explicit Instance(const EvaluatorOptions& options);

  /// Every device, best kind first: discrete, integrated, virtual, software; within a kind in the loader's order.
  std::vector<vk::raii::PhysicalDevice> devices() const;

 private:
  void listen();

  vk::raii::Context context_;
  std::unique_ptr<std::function<void(std::string_view)>> on_validation_;  // behind a pointer: the messenger keeps its address
  vk::raii::Instance instance_;
  vk::raii::DebugUtilsMessengerEXT messenger_;
};

/// "discrete GPU", "integrated GPU", "virtual GPU", "software" or "other".
const char* kind_name(vk::PhysicalDeviceType type) noexcept;

/// A device that can be used, and the instance it belongs to, which must outlive it.
struct Opened {
  Instance instance;
  vk::raii::PhysicalDevice physical;
};
/// `name`: part of a device's name, case-insensitive; empty takes the first. Fails with `unavailable` where there is none, and with
/// `invalid` where options.max_storage_range is too small. Throws std::exception.
Result<Opened> open_device(const EvaluatorOptions& options, std::string_view name);

/// A queue family that computes, alone if there is one; -1 for none.
int compute_family(const vk::raii::PhysicalDevice& device);

/// Why a device cannot be used; empty where it can.
std::string obstacle(const vk::raii::PhysicalDevice& device);

DeviceDescription describe(const vk::raii::PhysicalDevice& device);

}  // namespace swarmfit::kernels::vulkan
