#include "kernels/gpu_nodes.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <system_error>

namespace swarmfit::kernels {
namespace {

#ifdef __linux__
/// How their names begin; any card or render node of DRM, and what vendors use beside or in place of it. Rather one too many.
constexpr std::array<std::string_view, 13> kNodes = {
    "nvidia",   "nvhost",  "nvmap", "nvgpu",  // NVIDIA, discrete and Tegra
    "kfd",                                    // AMD
    "dxg",                                    // Windows' GPU in WSL
    "mali",     "bifrost",                    // Arm
    "kgsl",                                   // Qualcomm
    "pvr",                                    // Imagination
    "galcore",                                // Vivante
    "goldfish", "virtgpu",                    // a host's GPU in an emulator
};

bool is_gpu(const std::filesystem::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const auto begins = [&](std::string_view start) { return name.starts_with(start); };
  if (name != "dri") return std::any_of(kNodes.begin(), kNodes.end(), begins);
  std::error_code error;
  std::filesystem::directory_iterator nodes(entry.path(), error);
  if (error) return true;
  return std::any_of(begin(nodes), end(nodes), [](const std::filesystem::directory_entry& node) {
    const std::string of_drm = node.path().filename().string();
    return of_drm.starts_with("render") || of_drm.starts_with("card");
  });
}
#endif

}  // namespace

bool may_have_gpu([[maybe_unused]] const std::filesystem::path& devices) {
#ifdef __linux__
  std::error_code error;
  for (std::filesystem::directory_iterator it(devices, error), end; !error && it != end; it.increment(error)) {
    if (is_gpu(*it)) return true;
  }
  return static_cast<bool>(error);
#else
  return true;
#endif
}

}  // namespace swarmfit::kernels
