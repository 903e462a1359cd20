// swarmfit demo
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <swarmfit/results.hpp>
#include <swarmfit/scene.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/html_report.hpp"
#include "host/cli/identity_check.hpp"
#include "host/cli/perceive.hpp"
#include "host/cli/sequence.hpp"
#include "host/cli/truth_table.hpp"

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPairFolder = "/usr/lib/python3/dist-packages/skimage/data";

/// Middlebury's numbers for the pair at scikit-image's size. Disparities stay below ndisp.
constexpr const char* kMotorcycleCalib =
    "cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]\n"
    "cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]\n"
    "doffs=31.086\nbaseline=193.001\nwidth=741\nheight=500\nndisp=64\n";

struct DemoArguments {
  bool motorcycle = false;
  std::string pair = kPairFolder, frames;
  FitFlags fit;
  SceneFlags scene;
  OutputFlags output;
};

int run_room(PerceiveJob job) {
  auto scene = std::make_shared<const Scene>(make_room_scene());
  job.input = "the built-in scene";
  job.read = [scene]() -> Expected<Cloud> { return scene->cloud; };
  job.more = [scene](const PerceiveResult& result, const Cloud&) { return truth_table(*scene, result); };
  return run_perceive(job);
}

int run_motorcycle(PerceiveJob job, const std::string& folder) {
  const fs::path left = fs::path(folder) / "motorcycle_left.png", right = fs::path(folder) / "motorcycle_right.png";
  for (const auto& file : {left, right}) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) {
      return complain({Error::Kind::bad_input,
                       file.string() + ": not there; install Debian's package python3-skimage, or give the folder that holds the pair"});
    }
  }
  const fs::path calib = fs::path(job.output.out) / "calib.txt";
  if (auto ok = job.output.check(); !ok) return complain(ok.error());
  std::error_code error;
  fs::create_directories(job.output.out, error);  // what is wrong with it shows below
  if (auto ok = write_text(calib, kMotorcycleCalib); !ok) return complain(ok.error());
  job.input = left.string();
  job.read = [left, right, calib] { return read_stereo(left, right, calib); };
  return run_perceive(job);
}

/// A walk through the room; what is the same thing is known.
int run_walk(const DemoArguments& arguments, std::size_t frames) {
  SequenceJob job;
  if (auto ok = arguments.fit.apply(job.options.fit); !ok) return complain(ok.error());
  if (auto ok = arguments.scene.apply(job.options); !ok) return complain(ok.error());
  if (!arguments.output.labels.empty()) return complain({Error::Kind::invalid_option, "--labels: is of one frame, not with --frames"});
  if (!arguments.output.report.empty()) return complain({Error::Kind::invalid_option, "--report: is of one frame, not with --frames"});
  job.output = arguments.output;
  auto truth = std::make_shared<SceneTruth>();
  auto check = std::make_shared<IdentityCheck>();
  job.next = [=, next = std::size_t{0}](const std::stop_token& stop) mutable -> std::optional<FrameRef> {
    if (next >= frames || stop.stop_requested()) return std::nullopt;
    const std::size_t k = next++;
    return FrameRef{k, fmt::format("{:04}", k), "the built-in scene", [=]() -> Expected<Cloud> {
                      Scene scene = make_room_scene(1, 640, 480, walk_in_room(k, frames));
                      *truth = std::move(scene.truth);
                      return std::move(scene.cloud);
                    }};
  };
  job.ahead = false;  // the drawing would take time from the work that is timed
  job.watch = [=](const FrameRef&, const PerceiveResult& result, const Cloud&) { check->add(*truth, result); };
  job.more = [check] { return check->report(); };
  return run_sequence(job);
}

int run(const DemoArguments& arguments, const CLI::App& app) {
  if (!arguments.frames.empty()) {
    const auto frames = parse_number(arguments.frames);
    if (!frames || *frames < 1 || *frames > 1e6 || *frames != std::floor(*frames))
      return complain({Error::Kind::invalid_option, fmt::format("--frames: {}, must be a whole number in 1..1000000", arguments.frames)});
    if (arguments.motorcycle) return complain({Error::Kind::invalid_option, "--frames and --motorcycle exclude each other"});
    return run_walk(arguments, static_cast<std::size_t>(*frames));
  }
  PerceiveJob job;
  if (auto ok = arguments.fit.apply(job.options.fit); !ok) return complain(ok.error());
  if (auto ok = arguments.scene.apply(job.options); !ok) return complain(ok.error());
  job.output = arguments.output;
  if (job.output.out.empty()) job.output.out = "swarmfit-demo";
  job.notes = report_notes(app, arguments.motorcycle ? "Motorcycle" : "the built-in scene");
  return arguments.motorcycle ? run_motorcycle(std::move(job), arguments.pair) : run_room(std::move(job));
}

}  // namespace

Command add_demo(CLI::App& app) {
  auto a = std::make_shared<DemoArguments>();
  CLI::App* sub = app.add_subcommand("demo", "The whole chain on the built-in scene, its truth beside what was found");
  auto* motorcycle =
      sub->add_option("--motorcycle", a->pair, fmt::format("Instead: the real stereo pair Motorcycle, from this folder [{}]", kPairFolder));
  motorcycle->type_name("DIR")->expected(0, 1);
  sub->add_option("--frames", a->frames,
                  "Instead: a walk through the scene, so many frames long, as a sequence: one line of JSON a frame, files only with --out")
      ->type_name("N");
  a->scene.add_to(*sub);
  a->fit.add_to(*sub);
  a->output.add_to(*sub, "A folder for the results; look at overlay.png [swarmfit-demo]");
  sub->footer("examples:\n  swarmfit demo\n  swarmfit demo --motorcycle --out motorcycle\n  swarmfit demo --frames 300 > walk.jsonl");
  return {sub, [a, motorcycle, sub] {
            a->motorcycle = motorcycle->count() > 0;
            if (a->pair.empty()) a->pair = kPairFolder;
            return run(*a, *sub);
          }};
}

}  // namespace swarmfit::cli
