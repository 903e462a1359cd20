// Whether a GPU can be here at all, without asking a driver.
#pragma once

#include <filesystem>

namespace swarmfit::kernels {

/// True unless `devices`, a folder as Linux has it at /dev, can be read and holds no node of a kind that GPUs are used through. Always true
/// on another system: there drivers must be asked. Drivers of software devices take tens of milliseconds and of MiB to say that they are
/// software.
bool may_have_gpu(const std::filesystem::path& devices = "/dev");

}  // namespace swarmfit::kernels
