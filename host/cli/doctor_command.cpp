// swarmfit doctor
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <dlfcn.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <swarmfit/backend.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/report.hpp>
#include <swarmfit/version.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/report.hpp"

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;

#ifdef SWARMFIT_CLI_VULKAN
constexpr bool kBuiltWithVulkan = true;
#else
constexpr bool kBuiltWithVulkan = false;
#endif

/// One line of the answer, and how to mend it where it needs that.
struct Finding {
  enum class State { good, lacking, broken } state = State::good;
  std::string what, found, fix;
};
using State = Finding::State;

/// Is a fit possible? Makes the back end and finds three planes with it.
std::vector<Finding> try_a_fit(const std::string& backend, bool& works) {
  FitOptions options;
  options.backend = backend;
  options.pipeline_cache = pipeline_cache_folder();
  auto fitter = Fitter::create(options);
  if (!fitter) {
    return {{State::broken, "back end", fitter.error().message, "--backend cpu is always there; swarmfit devices lists the rest"}};
  }
  const BackendInfo chosen = fitter->backend();
  std::vector<Finding> all = {
      {State::good, "back end", fmt::format("{} takes {}: {} ({})", backend, chosen.name, chosen.device, chosen.reason), ""}};
  std::vector<float> corner;
  for (int i = 0; i < 400; ++i) {
    const float u = 0.05F * static_cast<float>(i % 20), v = 0.05F * static_cast<float>(i / 20);
    for (const float value : {u, v, 0.F, u, 0.F, v, 0.F, u, v}) corner.push_back(value);
  }
  const Stopwatch watch;
  const auto result = fitter->fit(PointsView(corner, 3));
  works = result && result->models.size() == 3;
  if (works) {
    all.push_back({State::good, "a fit", fmt::format("the 3 planes of a corner, in {:.1f} ms", watch.ms()), ""});
  } else {
    const std::string found = result ? fmt::format("{} planes found in a corner of 3", result->models.size()) : result.error().message;
    all.push_back({State::broken, "a fit", found, "--backend cpu or reference, to see whether the device is at fault"});
  }
  return all;
}

std::vector<Finding> check_devices() {
  std::vector<Finding> all;
  for (const Device& device : devices()) {
    const std::string name = device.name.empty() || device.name == "none" ? "" : device.name + ": ";
    if (device.backend != "cpu") {
      const bool missing = !device.usable && device.kind != "none";
      all.push_back({device.usable ? State::good : State::lacking, device.backend, name + (device.usable ? "usable; " : "") + device.reason,
                     missing ? "--backend cpu works without it; a newer driver may lift the limit named above" : ""});
      continue;
    }
    all.push_back({State::good, "cpu", name + device.reason, ""});
    for (const auto& [limit, value] : device.limits) {
      if (limit == "instruction sets") all.push_back({State::good, "SIMD", value, ""});
      if (limit == "threads") {
        all.push_back(
            {State::good, "threads", fmt::format("{} of the {} of this machine", value, std::thread::hardware_concurrency()), ""});
      }
    }
  }
  return all;
}

/// Names of the .json files in `folder` of all places the Vulkan loader looks at.
std::vector<std::string> manifests(const char* folder) {
  std::vector<fs::path> places = {"/etc/vulkan", "/usr/share/vulkan", "/usr/local/share/vulkan", "/usr/local/etc/vulkan"};
  if (const char* home = std::getenv("HOME")) places.emplace_back(fs::path(home) / ".local/share/vulkan");
  std::vector<std::string> names;
  for (const fs::path& place : places) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(place / folder, error)) {
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

bool any_holds(const std::vector<std::string>& names, const char* part) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return name.find(part) != std::string::npos; });
}

std::vector<Finding> check_vulkan() {
  std::vector<Finding> all;
  if (!kBuiltWithVulkan) {
    all.push_back({State::lacking, "build", "made without Vulkan",
                   "sudo apt install libvulkan-dev glslang-tools, then build with -DSWARMFIT_VULKAN=ON"});
  }
  void* loader = ::dlopen("libvulkan.so.1", RTLD_LAZY | RTLD_LOCAL);
  if (loader) {
    all.push_back({State::good, "Vulkan loader", "libvulkan.so.1", ""});
    ::dlclose(loader);
  } else {
    all.push_back({State::lacking, "Vulkan loader", "libvulkan.so.1 is not there", "sudo apt install libvulkan1"});
  }

  const auto drivers = manifests("icd.d");
  std::error_code error;
  if (drivers.empty()) {
    all.push_back({State::lacking, "Vulkan drivers", "none",
                   "sudo apt install mesa-vulkan-drivers (Intel, AMD, software) or nvidia-vulkan-icd (NVIDIA)"});
  } else if (fs::exists("/dev/nvidiactl", error) && !any_holds(drivers, "nvidia")) {
    all.push_back({State::lacking, "Vulkan drivers", fmt::format("{}; an NVIDIA GPU, but no driver for it", fmt::join(drivers, ", ")),
                   "sudo apt install nvidia-vulkan-icd (non-free)"});
  } else {
    all.push_back({State::good, "Vulkan drivers", fmt::format("{}", fmt::join(drivers, ", ")), ""});
  }

  std::vector<std::string> closed, nodes;
  for (const auto& entry : fs::directory_iterator("/dev/dri", error)) {
    const std::string node = entry.path().string();
    if (node.find("renderD") == std::string::npos) continue;
    (::access(node.c_str(), R_OK | W_OK) == 0 ? nodes : closed).push_back(node);
  }
  if (!closed.empty()) {
    all.push_back({State::lacking, "GPU nodes", fmt::format("{} cannot be opened by this user", fmt::join(closed, ", ")),
                   "sudo usermod -aG render $USER, then log in again"});
  } else if (nodes.empty() && !fs::exists("/dev/nvidiactl", error)) {
    all.push_back({State::lacking, "GPU nodes", "none: no GPU here, or not let into this container",
                   "of a container: run it with --device /dev/dri, or with --gpus all for NVIDIA"});
  } else {
    all.push_back({State::good, "GPU nodes", nodes.empty() ? "/dev/nvidiactl" : fmt::format("{}", fmt::join(nodes, ", ")), ""});
  }

  if (any_holds(manifests("explicit_layer.d"), "khronos_validation")) {
    all.push_back({State::good, "Vulkan layers", "validation", ""});
  } else {
    all.push_back({State::lacking, "Vulkan layers", "no validation; needed only to work on Swarmfit itself",
                   "sudo apt install vulkan-validationlayers"});
  }
  return all;
}

Finding check_cache() {
  const fs::path folder = pipeline_cache_folder();
  if (folder.empty()) {
    return {State::lacking, "pipeline cache", "no place for it: neither XDG_CACHE_HOME nor HOME is a folder",
            "export HOME=/a/folder/of/yours"};
  }
  std::error_code error;
  fs::path nearest = folder;
  while (!fs::exists(nearest, error) && nearest.has_relative_path()) nearest = nearest.parent_path();
  if (fs::is_directory(nearest, error) && ::access(nearest.c_str(), W_OK | X_OK) == 0) return {State::good, "pipeline cache", folder, ""};
  return {State::lacking, "pipeline cache", folder.string() + " cannot be written: Vulkan pipelines are compiled at each start",
          fmt::format("sudo chown -R $USER {}", nearest.string())};
}

Finding check_pages() {
  if (const auto can = check_report(); !can)
    return {State::lacking, "reports", can.error().message,
            "tools/setup.sh --report && npm ci --prefix report, then configure and build anew"};
  return {State::good, "reports", "--report writes pages", ""};
}

int run(const std::string& backend) {
  bool works = false;
  std::vector<Finding> findings = try_a_fit(backend, works);
  const auto append = [&](const std::vector<Finding>& more) { findings.insert(findings.end(), more.begin(), more.end()); };
  append(check_devices());
  append(check_vulkan());
  findings.push_back(check_cache());
  findings.push_back(check_pages());
  findings.push_back({State::good, "libraries", SWARMFIT_CLI_LIBRARIES, ""});
  findings.push_back({State::good, "build", SWARMFIT_CLI_BUILD, ""});

  std::vector<std::vector<std::string>> rows;
  for (const Finding& finding : findings) {
    const char* mark = finding.state == State::good ? "ok" : finding.state == State::lacking ? "--" : "NO";
    rows.push_back({mark, finding.what, finding.found});
    if (!finding.fix.empty()) rows.push_back({"", "  to mend it", finding.fix});
  }
  fmt::print("swarmfit {}.{}.{}\n{}{}\n", SWARMFIT_VERSION_MAJOR, SWARMFIT_VERSION_MINOR, SWARMFIT_VERSION_PATCH,
             painted_marks(table(rows)), works ? "fit can run" : "fit cannot run");
  return works ? kDone : kNoBackend;
}

}  // namespace

Command add_doctor(CLI::App& app) {
  auto backend = std::make_shared<std::string>("auto");
  CLI::App* sub = app.add_subcommand("doctor", "What is installed, which device would be taken and why, how to get what is missing");
  sub->add_option("--backend", *backend, "Which to try: auto, cpu, vulkan, reference, or part of a device's name")
      ->type_name("NAME")
      ->capture_default_str();
  sub->footer("Marks: ok, -- not there but not needed for a fit, NO a fit fails over it.\nExit code 0 if fit can run, 4 if not.");
  return {sub, [backend] { return run(*backend); }};
}

}  // namespace swarmfit::cli
