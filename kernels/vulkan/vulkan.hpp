// Vulkan, without linking the loader: vulkan_raii opens it at run time and throws where there is none.
#pragma once

#define VK_NO_PROTOTYPES
#define VULKAN_HPP_DISPATCH_LOADER_DYNAMIC 1
#include <vulkan/vulkan_raii.hpp>
