// swarmfit figures
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/cloud.hpp>
#include <swarmfit/figures.hpp>
#include <swarmfit/results.hpp>
#include <swarmfit/scene.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/options.hpp"

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;

struct FiguresArguments {
  std::string out, frame, seed = "1";
  bool quiet = false;
};

int run(const FiguresArguments& arguments) {
  FitFlags flags;
  flags.seed = arguments.seed;
  FitOptions options;
  if (auto ok = flags.apply(options); !ok) return complain(ok.error());
  if (auto ok = check_writable_folder(arguments.out); !ok) return complain(ok.error());
  auto frame = arguments.frame.empty() ? Expected<Cloud>(make_room_scene(options.seed).cloud) : read_cloud(arguments.frame);
  if (!frame) return complain(frame.error());
  PerceiveOptions perceive;
  perceive.fit.seed = options.seed;
  auto stages = perception_figures(*frame, perceive);
  if (!stages) return complain(stages.error());
  auto figures = paper_figures(options.seed);
  if (!figures) return complain(figures.error());
  std::move(stages->begin(), stages->end(), std::back_inserter(*figures));
  std::error_code error;
  fs::create_directories(arguments.out, error);  // what is wrong with it shows below
  for (const Figure& figure : *figures) {
    const fs::path file = fs::path(arguments.out) / figure.name;
    if (auto ok = write_text(file, figure.bytes); !ok) return complain(ok.error());
    if (!arguments.quiet) fmt::print("{}: {}\n", file.string(), figure.shows);
  }
  return kDone;
}

}  // namespace

Command add_figures(CLI::App& app) {
  auto arguments = std::make_shared<FiguresArguments>();
  CLI::App* sub = app.add_subcommand("figures", "The figures of the paper behind the method, from real runs");
  sub->add_option("--out", arguments->out, "The folder for the .svg and .jpg files")->type_name("DIR")->required();
  sub->add_option("--frame", arguments->frame, "Of figures 4 and 5: an organised coloured cloud, .pcd or .ply [the built-in scene]")
      ->type_name("FILE");
  sub->add_option("--seed", arguments->seed, "Of the scenes and the swarms")->type_name("N")->capture_default_str();
  sub->add_flag("--quiet", arguments->quiet, "Nothing on stdout");
  sub->footer(
      "examples:\n"
      "  swarmfit figures --out figures\n"
      "  swarmfit figures --out figures --frame table.pcd");
  return {sub, [arguments] { return run(*arguments); }};
}

}  // namespace swarmfit::cli
