// swarmfit figures
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/figures.hpp>
#include <swarmfit/results.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/options.hpp"

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;

struct FiguresArguments {
  std::string out, seed = "1";
  bool quiet = false;
};

int run(const FiguresArguments& arguments) {
  FitFlags flags;
  flags.seed = arguments.seed;
  FitOptions options;
  if (auto ok = flags.apply(options); !ok) return complain(ok.error());
  if (auto ok = check_writable_folder(arguments.out); !ok) return complain(ok.error());
  const auto figures = paper_figures(options.seed);
  if (!figures) return complain(figures.error());
  std::error_code error;
  fs::create_directories(arguments.out, error);  // what is wrong with it shows below
  for (const Figure& figure : *figures) {
    const fs::path file = fs::path(arguments.out) / figure.name;
    if (auto ok = write_text(file, figure.svg); !ok) return complain(ok.error());
    if (!arguments.quiet) fmt::print("{}: {}\n", file.string(), figure.shows);
  }
  return kDone;
}

}  // namespace

Command add_figures(CLI::App& app) {
  auto arguments = std::make_shared<FiguresArguments>();
  CLI::App* sub = app.add_subcommand("figures", "The figures of the paper behind the method, from real runs");
  sub->add_option("--out", arguments->out, "The folder for the .svg files")->type_name("DIR")->required();
  sub->add_option("--seed", arguments->seed, "Of the scenes and the swarms")->type_name("N")->capture_default_str();
  sub->add_flag("--quiet", arguments->quiet, "Nothing on stdout");
  sub->footer("example:\n  swarmfit figures --out figures");
  return {sub, [arguments] { return run(*arguments); }};
}

}  // namespace swarmfit::cli
