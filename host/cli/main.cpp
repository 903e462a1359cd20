// The command `swarmfit`: parses, dispatches, and turns whatever goes wrong into one line and an exit code.
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <swarmfit/version.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/help_format.hpp"
#include "host/cli/help_tree.hpp"
#include "host/cli/process.hpp"

namespace swarmfit::cli {
namespace {

constexpr const char* kFooter = R"(A first run:
  swarmfit demo                              the built-in scene; then look at swarmfit-demo/overlay.png
  swarmfit perceive table.pcd --out result   planes, objects and their outlines in a depth camera's frame
  swarmfit fit plane scan.ply --json r.json  every plane of a cloud
  swarmfit doctor                            what is installed, and how to get what is missing
  swarmfit SUBCOMMAND --help                 all options, more examples

Units: metres for 3D input, the data's own unit for 2D; angles in degrees, times in milliseconds.
Exit codes: 0 done, 2 wrong usage, 3 input cannot be used or output not written, 4 back end cannot be used.
An error is one line on stderr.)";

/// "fit, perceive, ...": the commands there are.
std::string command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto& command : help_tree(app).commands) names.push_back(command.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// An option whose value is empty, as where a shell's variable is not set: what was meant is not known.
const CLI::Option* empty_option(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    const auto& values = option->results();
    const bool takes_value = option->get_items_expected_min() > 0 || option->get_positional();
    if (takes_value && std::find(values.begin(), values.end(), std::string()) != values.end()) return option;
  }
  return nullptr;
}

/// What CLI11 has to say, in our form.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error, int argc, const char* const* argv) {
  const auto subcommands = app.get_subcommands();
  if (subcommands.empty()) {
    const std::string first = argc > 1 ? argv[1] : "";
    const std::string what = first.empty() ? "no subcommand" : first + ": not known";
    return fmt::format("{}; must be one of {} (swarmfit --help tells more)", what, command_names(app));
  }
  return fmt::format("{} (swarmfit {} --help tells more)", error.what(), subcommands.front()->get_name());
}

int run(int argc, const char* const* argv) {
  CLI::App app("Swarmfit: all models of a kind in data full of outliers, by particle swarm; and a robot's eye on top of it.", "swarmfit");
  app.set_version_flag("--version",
                       fmt::format("swarmfit {}.{}.{}", SWARMFIT_VERSION_MAJOR, SWARMFIT_VERSION_MINOR, SWARMFIT_VERSION_PATCH));
  app.require_subcommand(1);
  app.footer(kFooter);
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->column_width(32);
  const std::vector<Command> commands = {add_fit(app),  add_perceive(app), add_learn(app),  add_bench(app),      add_devices(app),
                                         add_demo(app), add_figures(app),  add_doctor(app), add_completion(app), add_man(app)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);  // --help, --version
  } catch (const CLI::ParseError& error) {
    return wrong_usage(usage_error(app, error, argc, argv));
  }
  for (const Command& command : commands) {
    if (!command.app->parsed()) continue;
    if (const CLI::Option* empty = empty_option(*command.app)) {
      return wrong_usage(fmt::format("{}: empty, must be {}", empty->get_name(), empty->get_type_name()));
    }
    return command.run();
  }
  return kWrongUsage;
}

/// What was printed has to get out.
int finish(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  const std::string why = errno != 0 ? ": " + std::generic_category().message(errno) : "";
  return complain({Error::Kind::cannot_write, "stdout: cannot be written" + why});
}

}  // namespace
}  // namespace swarmfit::cli

int main(int argc, char** argv) {
  swarmfit::cli::settle_process();
  try {
    swarmfit::cli::remember_command(argc, argv);
    return swarmfit::cli::finish(swarmfit::cli::run(argc, argv));
  } catch (const std::exception& e) {
    if (std::ferror(stdout) != 0) return swarmfit::cli::finish(0);
    return swarmfit::cli::complain(swarmfit::cli::error_of(e));
  }
}
