// The list of back ends by name. An unknown name is an error; `auto` takes a real GPU, else the CPU, never software Vulkan.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/fitness_evaluator.hpp"
#include "kernels/own/own_model.hpp"

namespace swarmfit::kernels {

struct EvaluatorOptions {
  int threads = 0;                                      ///< worker threads of the CPU back end; 0 takes all
  std::string simd;                                     ///< CPU instruction set by name ("scalar", "AVX2", ...); empty takes the best
  bool pruning = true;                                  ///< leave out what provably changes no cost; the costs are the same either way
  bool validation = false;                              ///< Vulkan validation layers with synchronisation validation
  std::function<void(std::string_view)> on_validation;  ///< called with every validation message
  std::filesystem::path pipeline_cache;                 ///< folder of Vulkan pipeline caches; empty keeps none
  std::size_t max_storage_range = 0;    ///< Vulkan: pretend the device's storage-buffer range is this many bytes (tests); 0 the device's
  std::shared_ptr<const OwnModel> own;  ///< the one model to evaluate, in place of those that are built in; null: these
  bool gpu_paths = false;               ///< Vulkan: work on a software device as on a GPU with memory of its own (tests)
};

/// One way to evaluate on this machine.
struct DeviceDescription {
  std::string backend;  ///< "reference", "cpu", "vulkan"
  std::string device;   ///< name as accepted by make_evaluator
  std::string kind;     ///< "cpu", "discrete GPU", "integrated GPU", "software"
  bool usable = false;
  std::string reason;  ///< why not, or what `auto` thinks of it
  std::vector<std::pair<std::string, std::string>> limits;
};

std::vector<DeviceDescription> list_devices();

struct Selection {
  std::unique_ptr<FitnessEvaluator> evaluator;
  std::string reason;  ///< why this one, for the result
};

/// Whether a device's name holds this part, upper case or lower; false for an empty part.
bool contains_ignoring_case(std::string_view text, std::string_view part);

/// `name`: auto, cpu, vulkan, reference, or (part of) a device's name as listed. Fails with `unavailable` or `invalid`.
Result<Selection> make_evaluator(std::string_view name, const EvaluatorOptions& options);

// One factory a back end, each defined in its own folder. For an own model, the first two take make_own_evaluator.
Result<std::unique_ptr<FitnessEvaluator>> make_reference_evaluator();
Result<std::unique_ptr<FitnessEvaluator>> make_cpu_evaluator(const EvaluatorOptions& options);
std::vector<DeviceDescription> cpu_devices();
/// Evaluates `options.own`, not null, by its function in double precision: "reference" one point after another, "cpu" on its threads.
Result<std::unique_ptr<FitnessEvaluator>> make_own_evaluator(std::string_view backend, const EvaluatorOptions& options);
/// `device`: part of a device's name, case-insensitive; empty takes the first by kind (discrete, integrated, virtual, software).
Result<std::unique_ptr<FitnessEvaluator>> make_vulkan_evaluator(const EvaluatorOptions& options, std::string_view device);
std::vector<DeviceDescription> vulkan_devices();

}  // namespace swarmfit::kernels
