// Where no GPU can be, `auto` asks no driver. Each test is a process of its own: what one has loaded, no other sees.
#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "kernels/evaluators.hpp"
#include "kernels/gpu_nodes.hpp"
#include "tests/io_files.hpp"

namespace swarmfit::kernels {
namespace {

using tests::TemporaryFolder;

TEST(GpuNodes, AFolderOfOtherDevicesHasNoGpu) {
  const TemporaryFolder devices;
  EXPECT_FALSE(may_have_gpu(devices.path()));
  for (const char* node : {"null", "kvm", "tty0", "fb", "snd", "loop0", "vga_arbiter", "accel"}) devices.put(node, "");
  std::filesystem::create_directory(devices / "dri");
  devices.put("dri/by-path", "");
  EXPECT_FALSE(may_have_gpu(devices.path()));
}

TEST(GpuNodes, OneNodeIsEnough) {
  for (const char* node : {"dri/renderD128", "dri/card0", "nvidia0", "nvidiactl", "nvhost-gpu", "nvgpu", "kfd", "dxg", "mali0", "kgsl-3d0",
                           "pvrsrvkm", "galcore", "goldfish_pipe"}) {
    const TemporaryFolder devices;
    devices.put("null", "");
    std::filesystem::create_directory(devices / "dri");
    devices.put(node, "");
    EXPECT_TRUE(may_have_gpu(devices.path())) << node;
  }
}

TEST(GpuNodes, WhatCannotBeReadMayHoldOne) {
  const TemporaryFolder devices;
  EXPECT_TRUE(may_have_gpu(devices / "not there"));
  EXPECT_TRUE(may_have_gpu(devices.put("no folder", "")));
}

TEST(GpuNodes, AutoLoadsNoDriverWhereThereIsNone) {
  if (may_have_gpu()) GTEST_SKIP() << "this machine may have a GPU";
  if (std::getenv("LD_PRELOAD") != nullptr) GTEST_SKIP() << "a driver may be preloaded, as sanitizers need it";
  const auto made = make_evaluator("auto", {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->evaluator->identity().backend, "cpu");
  EXPECT_EQ(made->reason, "auto: no GPU in /dev");
  const std::string loaded = tests::contents("/proc/self/maps");
  ASSERT_FALSE(loaded.empty());
  EXPECT_EQ(loaded.find("libvulkan"), std::string::npos);
}

}  // namespace
}  // namespace swarmfit::kernels
