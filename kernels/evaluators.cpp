#include "kernels/evaluators.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "kernels/gpu_nodes.hpp"

namespace swarmfit::kernels {
namespace {

Result<Selection> selected(Result<std::unique_ptr<FitnessEvaluator>> made, std::string reason) {
  if (!made) return tl::unexpected(made.error());
  return Selection{std::move(*made), std::move(reason)};
}

Result<std::unique_ptr<FitnessEvaluator>> make_cpu(const EvaluatorOptions& options) {
  return options.own ? make_own_evaluator("cpu", options) : make_cpu_evaluator(options);
}

Result<std::unique_ptr<FitnessEvaluator>> make_reference(const EvaluatorOptions& options) {
  return options.own ? make_own_evaluator("reference", options) : make_reference_evaluator();
}

Result<Selection> choose_automatically(const EvaluatorOptions& options) {
  if (options.own && options.own->glsl.empty()) return selected(make_cpu(options), "auto: the own model has no GLSL");
  // Asking every driver takes tens of milliseconds, and a process may make many evaluators; what is plugged in later is taken by name.
  static const bool may_be_there = may_have_gpu();
  if (!may_be_there) return selected(make_cpu(options), "auto: no GPU in /dev");
  static const std::vector<DeviceDescription> devices = vulkan_devices();
  std::string why = "no GPU with Vulkan here";
  for (const DeviceDescription& device : devices) {
    if (!device.usable || device.kind == "software") {
      if (device.kind == "software") why = fmt::format("the only Vulkan device, {}, is software", device.device);
      continue;
    }
    auto made = make_vulkan_evaluator(options, device.device);
    if (made) return Selection{std::move(*made), fmt::format("auto: {} is a {}", device.device, device.kind)};
    if (made.error().kind == Failure::Kind::invalid) return tl::unexpected(made.error());
    why = made.error().message;
  }
  return selected(make_cpu(options), "auto: " + why);
}

}  // namespace

bool contains_ignoring_case(std::string_view text, std::string_view part) {
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  return !part.empty() && std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

std::vector<DeviceDescription> list_devices() {
  std::vector<DeviceDescription> all = cpu_devices();
  std::vector<DeviceDescription> gpus = vulkan_devices();
  std::move(gpus.begin(), gpus.end(), std::back_inserter(all));
  all.push_back({"reference", "reference", "cpu", true, "double precision, serial: the oracle; by name only", {}});
  return all;
}

Result<Selection> make_evaluator(std::string_view name, const EvaluatorOptions& options) {
  if (options.threads < 0) return fail(Failure::Kind::invalid, fmt::format("threads is {}, must be >= 0", options.threads));
  if (name == "auto") return choose_automatically(options);
  if (name == "cpu") return selected(make_cpu(options), "asked for by name");
  if (name == "reference") return selected(make_reference(options), "asked for by name");
  if (name == "vulkan") return selected(make_vulkan_evaluator(options, ""), "asked for by name");
  std::string known = "auto, cpu, vulkan, reference";
  for (const DeviceDescription& device : list_devices()) {
    if (device.backend != "reference" && device.kind != "none" && contains_ignoring_case(device.device, name)) {
      return selected(device.backend == "cpu" ? make_cpu(options) : make_vulkan_evaluator(options, device.device),
                      "asked for by device name");
    }
    if (device.backend == "vulkan" && device.kind != "none") known += ", " + device.device;
  }
  return fail(Failure::Kind::unavailable, fmt::format("backend is '{}', must be one of: {}", name, known));
}

#ifndef SWARMFIT_HAVE_VULKAN
std::vector<DeviceDescription> vulkan_devices() {
  return {{"vulkan", "none", "none", false, "this build has no Vulkan (SWARMFIT_VULKAN=OFF)", {}}};
}
Result<std::unique_ptr<FitnessEvaluator>> make_vulkan_evaluator(const EvaluatorOptions&, std::string_view) {
  return fail(Failure::Kind::unavailable, "backend is 'vulkan', but this build has no Vulkan (SWARMFIT_VULKAN=OFF)");
}
#endif

}  // namespace swarmfit::kernels
