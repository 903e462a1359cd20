// swarmfit devices
#include <cstdio>

#include <fmt/format.h>

#include <swarmfit/backend.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"

namespace swarmfit::cli {

Command add_devices(CLI::App& app) {
  CLI::App* sub = app.add_subcommand("devices", "Back ends, devices, limits, and why one cannot be used");
  sub->footer("Give --backend a back end's name (cpu) or part of a device's (h200).");
  return {sub, [] {
            for (const Device& device : devices()) {
              fmt::print("{:<10} {}  [{}]\n", device.backend, device.name.empty() ? "-" : device.name, device.kind);
              fmt::print("           {}{}\n", device.usable ? "usable" : "cannot be used",
                         device.reason.empty() ? "" : ": " + device.reason);
              for (const auto& [limit, value] : device.limits) fmt::print("           {}: {}\n", limit, value);
            }
            return static_cast<int>(kDone);
          }};
}

}  // namespace swarmfit::cli
