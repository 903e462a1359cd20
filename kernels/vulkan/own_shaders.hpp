// The shaders for a model that its user brought as GLSL, compiled at run time.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/own/own_model.hpp"
#include "kernels/status.hpp"

namespace swarmfit::kernels::vulkan {

/// SPIR-V of the shaders that look at models, with the own model's residual in place of those that are built in.
struct OwnShaders {
  std::vector<std::uint32_t> cost, distances, assign;
};

/// `texels`: as DeviceTraits has it. Fails with `invalid` where the GLSL is empty or does not compile, with the compiler's words; with
/// `unavailable` where this build has no compiler.
Result<OwnShaders> compile_own(const OwnModel& own, bool texels);

}  // namespace swarmfit::kernels::vulkan
