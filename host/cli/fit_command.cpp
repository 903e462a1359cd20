// swarmfit fit MODEL INPUT, or swarmfit fit INPUT --model MODEL
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/fit.hpp>
#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/html_report.hpp"
#include "host/cli/options.hpp"
#include "host/cli/process.hpp"
#include "host/cli/report.hpp"

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;

struct FitArguments {
  std::string model, input, option, normal, within, noise = "none";
  VerticalFlags vertical;
  FitFlags fit;
  OutputFlags output;
  CameraFlags camera;
};

bool is_png(const std::string& file) {
  const std::string extension = fs::path(file).extension().string();
  return extension == ".png" || extension == ".PNG";
}

/// --normal or the vertical, and --within: models within an angle of a direction.
Expected<> apply_prior(const FitArguments& arguments, FitOptions& options) {
  const auto invalid = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  const bool vertical = arguments.vertical.given();
  if (arguments.normal.empty() && arguments.within.empty() && !vertical) return {};
  if (arguments.normal.empty() && !vertical) return invalid("--within needs --normal, the direction it is measured from");
  if (!arguments.normal.empty() && vertical) return invalid("--normal excludes --gravity and --camera-tilt");
  const std::vector<ModelType> kinds = options.kinds();
  if (vertical && std::find(kinds.begin(), kinds.end(), ModelType::plane) == kinds.end())
    return invalid(fmt::format("--gravity and --camera-tilt are for horizontal planes, not for {}", arguments.model));
  const std::size_t columns = dimension(options.model) == 2 ? 2 : 3;
  DirectionPrior prior;
  if (vertical) {
    const auto axis = arguments.vertical.axis();
    if (!axis) return tl::unexpected(axis.error());
    prior.axis = *axis;
  } else {
    const auto normal = parse_list("--normal", arguments.normal, columns == 2 ? "X,Y" : "X,Y,Z", columns);
    if (!normal) return tl::unexpected(normal.error());
    prior.axis = Eigen::Vector3d((*normal)[0], (*normal)[1], columns == 2 ? 0 : (*normal)[2]);
    if (!(prior.axis.norm() > 0)) return invalid(fmt::format("--normal: {}, must not be zero", arguments.normal));
  }
  if (!arguments.within.empty()) {
    const auto degrees = parse_number(arguments.within);
    if (!degrees || !(*degrees > 0 && *degrees <= 90))
      return invalid(fmt::format("--within: {}, must be in (0, 90] degrees", arguments.within));
    prior.max_angle = *degrees * std::numbers::pi / 180;
  }
  options.prior = prior;
  return {};
}

Expected<FitOptions> fit_options(const FitArguments& arguments) {
  FitOptions options;
  const auto kinds = model_types(arguments.model);
  if (!kinds) return tl::unexpected(kinds.error());
  options.model = kinds->front();
  options.rivals.assign(kinds->begin() + 1, kinds->end());
  if (auto ok = apply_prior(arguments, options); !ok) return tl::unexpected(ok.error());
  if (auto ok = arguments.fit.apply(options); !ok) return tl::unexpected(ok.error());
  if (arguments.noise != "none" && arguments.noise != "depth") {
    return fail(Error::Kind::invalid_option, fmt::format("--noise: {}, must be none or depth", arguments.noise));
  }
  options.noise = arguments.noise == "depth" ? Noise::depth : Noise::none;
  if (auto ok = options.validate(); !ok) return tl::unexpected(ok.error());
  if (auto camera = arguments.camera.camera(); is_png(arguments.input) && !camera) return tl::unexpected(camera.error());
  return options;
}

Expected<Cloud> read_input(const FitArguments& arguments) {
  if (!is_png(arguments.input)) return read_cloud(arguments.input);
  const auto camera = arguments.camera.camera();
  if (!camera) return tl::unexpected(camera.error());
  return read_depth(arguments.input, camera->intrinsics, camera->scale);
}

Expected<> write(const FitArguments& arguments, const FitResult& result, const Cloud& input, double load_ms, const SearchRecord& search,
                 const CLI::App& app) {
  const auto& output = arguments.output;
  const std::string json = to_json(result, input, load_ms);
  if (!output.json.empty()) {
    if (auto ok = write_text(output.json, json); !ok) return ok;
  }
  if (!output.labels.empty()) {
    if (auto ok = write_labels(output.labels, result.labels); !ok) return ok;
  }
  if (!output.report.empty()) {
    const auto notes = report_notes(app, arguments.model + " " + fs::path(arguments.input).filename().string());
    if (auto ok = write_report(output.report, report_page(result, input, load_ms, search, notes)); !ok) return ok;
  }
  if (output.out.empty()) return {};
  std::error_code error;
  fs::create_directories(output.out, error);  // what is wrong with it shows below
  if (auto ok = write_text(fs::path(output.out) / "result.json", json); !ok) return ok;
  return write_labels(fs::path(output.out) / "labels.txt", result.labels);
}

/// MODEL INPUT, or --model MODEL with INPUT alone.
Expected<> tell_apart(FitArguments& arguments) {
  const auto invalid = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  if (!arguments.option.empty()) {
    if (!arguments.input.empty())
      return invalid(fmt::format("--model: {}, must not be given beside {}", arguments.option, arguments.model));
    arguments.input = std::exchange(arguments.model, arguments.option);
  } else if (arguments.model.empty()) {
    return invalid("model is missing, must be given: swarmfit fit MODEL INPUT (swarmfit fit --help tells more)");
  }
  if (arguments.input.empty()) return invalid("input is missing, must be given: swarmfit fit MODEL INPUT (swarmfit fit --help tells more)");
  return {};
}

int run(FitArguments& arguments, const CLI::App& app) {
  if (auto ok = tell_apart(arguments); !ok) return complain(ok.error());
  const auto options = fit_options(arguments);
  if (!options) return complain(options.error());
  if (auto ok = arguments.output.check(); !ok) return complain(ok.error());

  const Interrupt interrupt;
  FitResult result;
  SearchRecord search;
  Cloud input;
  double load_ms = 0, ready_ms = 0;
  {
    Progress progress(arguments.output.quiet);
    progress.say("making the back end ready");
    const Stopwatch starting;
    auto fitter = Fitter::create(*options);
    if (!fitter) return complain(fitter.error());
    // A device would compile pipelines for few points as well as for those that come.
    if (fitter->backend().name == "cpu") fitter->prepare();
    ready_ms = starting.ms();
    progress.say("reading " + arguments.input);
    const Stopwatch loading;
    auto cloud = read_input(arguments);
    if (!cloud) return complain(cloud.error());
    input = std::move(*cloud);
    settle_large_input(input.values32.size() * sizeof(float) + input.values64.size() * sizeof(double));
    load_ms = loading.ms();

    progress.say("fitting");
    progress.within(options->time_budget_ms);
    std::size_t found = 0;
    if (!arguments.output.report.empty()) fitter->observe([&](const SwarmStep& step) { search.add(step); });
    const auto on_model = [&](const Model& model) {
      ++found;
      search.add(model);
      progress.step(fmt::format("fitting, {} found so far", found), found, options->max_models);
      return Verdict::go_on;
    };
    auto fitted = fitter->fit(input.points(), on_model, interrupt.token());
    if (!fitted) return complain(fitted.error());
    result = std::move(*fitted);
  }
  const Stopwatch writing;
  if (auto ok = write(arguments, result, input, load_ms, search, app); !ok) return complain(ok.error());
  if (arguments.output.verbose) {
    for (const std::string& line : explanation(result, input)) note(line);
    note(stages({{"back end", ready_ms}, {"loading", load_ms}, {"fit", result.total_ms}, {"writing", writing.ms()}}));
  }
  if (!arguments.output.quiet) fmt::print("{}", summary(result, input, load_ms));
  return kDone;
}

}  // namespace

Command add_fit(CLI::App& app) {
  auto arguments = std::make_shared<FitArguments>();
  CLI::App* sub = app.add_subcommand("fit", "Find all models of a kind, or of several");
  std::string models;
  for (const ModelType type : model_types()) models += (models.empty() ? "" : ", ") + std::string(name(type));
  sub->add_option("model", arguments->model, "What to find: " + models + "; several, parted by commas, compete")->type_name("MODEL");
  sub->add_option(
         "input", arguments->input,
         ".pcd .ply .xyz .csv (x,y or x,y,z or x1,y1,x2,y2; a header is optional, a column named label is ignored), or a 16-bit depth .png")
      ->type_name("INPUT");
  sub->add_option("--model", arguments->option, "What to find, with INPUT alone")->type_name("MODEL")->group(FitFlags::kGroup);
  sub->add_option("--normal", arguments->normal, "Only models whose normal is near this direction (line2d: X,Y)")
      ->type_name("X,Y,Z")
      ->group(FitFlags::kGroup);
  sub->add_option("--within", arguments->within, "How near: within this angle [11.5]")->type_name("DEG")->group(FitFlags::kGroup);
  sub->add_option(
         "--noise", arguments->noise,
         "depth: beyond the near end (three tenths of the points) the threshold grows with the square of the depth z, as the noise of "
         "depth cameras and stereo does; it is estimated where none is given")
      ->type_name("none|depth")
      ->group(FitFlags::kGroup)
      ->capture_default_str();
  arguments->vertical.add_to(*sub, FitFlags::kGroup, "with it or --gravity, only planes that are level");
  arguments->fit.add_to(*sub, "plane, sphere, cylinder: 0.01; homography: 6; fundamental: 2.5; line2d, circle2d, --noise depth: auto");
  arguments->camera.add_to(*sub);
  arguments->output.add_to(*sub, "A folder for result.json and labels.txt");
  sub->footer(
      "examples:\n"
      "  swarmfit fit plane scan.ply --threshold 0.02 --labels labels.txt\n"
      "  swarmfit fit plane cloud.pcd --normal 0,0,1 --within 10 --json result.json\n"
      "  swarmfit fit plane,cylinder,sphere scan.ply\n"
      "  swarmfit fit line2d points.csv --threshold auto\n"
      "  swarmfit fit plane scan.ply --report scan.html\n"
      "  swarmfit fit plane depth.png --intrinsics 525,525,319.5,239.5 --depth-scale 0.001");
  return {sub, [arguments, sub] { return run(*arguments, *sub); }};
}

}  // namespace swarmfit::cli
