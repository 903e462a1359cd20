// The subcommands. Each adds itself to the application; once its arguments are parsed, `run` does the work and gives the exit code.
#pragma once

#include <functional>
#include <memory>

#include <CLI/CLI.hpp>

namespace swarmfit::cli {

struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

Command add_fit(CLI::App& app);
Command add_perceive(CLI::App& app);
Command add_learn(CLI::App& app);
Command add_bench(CLI::App& app);
Command add_devices(CLI::App& app);
Command add_demo(CLI::App& app);
Command add_figures(CLI::App& app);
Command add_doctor(CLI::App& app);
Command add_completion(CLI::App& app);
Command add_man(CLI::App& app);

}  // namespace swarmfit::cli
