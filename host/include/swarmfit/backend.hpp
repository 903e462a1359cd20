// Back ends and devices.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <swarmfit/export.hpp>

namespace swarmfit {

/// Who did the work, and why it was chosen.
struct BackendInfo {
  std::string name;  ///< "cpu", "vulkan", "reference"
  std::string device;
  std::string reason;
};

/// One way to evaluate on this machine.
struct Device {
  std::string backend;
  std::string name;  ///< accepted by FitOptions::backend
  std::string kind;  ///< "cpu", "discrete GPU", "integrated GPU", "software"
  bool usable = false;
  std::string reason;  ///< why it cannot be used, or what `auto` thinks of it
  std::vector<std::pair<std::string, std::string>> limits;
};

/// All of them, those that cannot be used included: the processor, Vulkan devices, the reference.
SWARMFIT_API std::vector<Device> devices();

}  // namespace swarmfit
