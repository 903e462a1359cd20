// swarmfit perceive INPUT...
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/perception.hpp>
#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/frames.hpp"
#include "host/cli/html_report.hpp"
#include "host/cli/perceive.hpp"
#include "host/cli/report.hpp"
#include "host/cli/sequence.hpp"

namespace swarmfit::cli {
namespace {

struct PerceiveArguments {
  std::vector<std::string> inputs;
  std::string color, depth, left, right, calib, fps;
  std::optional<bool> drop;
  FitFlags fit;
  SceneFlags scene;
  CameraFlags camera;
  OutputFlags output;
};

Expected<> write(const PerceiveJob& job, const PerceiveResult& result, const Cloud& input, const SearchRecord& search) {
  const OutputFlags& output = job.output;
  if (!output.json.empty()) {
    if (auto ok = write_text(output.json, to_json(result, input)); !ok) return ok;
  }
  if (!output.labels.empty()) {
    if (auto ok = write_labels(output.labels, result.fit.labels); !ok) return ok;
  }
  if (!output.report.empty()) {
    if (auto ok = write_report(output.report, report_page(result, input, search, job.notes)); !ok) return ok;
  }
  return output.out.empty() ? Expected<>() : write_perception(output.out, result, input);
}

/// Which of the three kinds of input was given; the reader for it.
Expected<std::function<Expected<Cloud>()>> reader(const PerceiveArguments& a) {
  const auto invalid = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  const bool rgbd = !a.color.empty() || !a.depth.empty();
  const bool stereo = !a.left.empty() || !a.right.empty() || !a.calib.empty();
  if (int{!a.inputs.empty()} + int{rgbd} + int{stereo} != 1) {
    return invalid("perceive takes one of: INPUT..., or --color and --depth with --intrinsics, or --left, --right and --calib");
  }
  if (!a.inputs.empty()) return [file = a.inputs.front()] { return read_cloud(file); };
  if (stereo) {
    for (const auto& [value, option] : {std::pair{&a.left, "--left"}, std::pair{&a.right, "--right"}, std::pair{&a.calib, "--calib"}}) {
      if (value->empty()) return invalid(fmt::format("{} FILE is missing: a stereo pair needs --left, --right and --calib", option));
    }
    return [left = a.left, right = a.right, calib = a.calib] { return read_stereo(left, right, calib); };
  }
  if (a.depth.empty()) return invalid("--depth FILE is missing: --color needs the depth image that goes with it");
  const auto camera = a.camera.camera();
  if (!camera) return tl::unexpected(camera.error());
  if (a.color.empty()) return [depth = a.depth, c = *camera] { return read_depth(depth, c.intrinsics, c.scale); };
  return [color = a.color, depth = a.depth, c = *camera] { return read_rgbd(color, depth, c.intrinsics, c.scale); };
}

/// What a sequence is made of.
Expected<FrameSource> source(const PerceiveArguments& a) {
  const auto invalid = [](std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); };
  std::optional<DepthCamera> camera;
  if (!a.camera.intrinsics.empty()) {
    const auto given = a.camera.camera();
    if (!given) return tl::unexpected(given.error());
    camera = *given;
  }
  const bool from_stdin = a.inputs == std::vector<std::string>{"-"};
  std::vector<FrameRef> frames;
  if (!from_stdin) {
    auto listed = list_frames(a.inputs, camera);
    if (!listed) return tl::unexpected(listed.error());
    frames = std::move(*listed);
  }
  if (!a.output.labels.empty()) return invalid("--labels: is of one frame; for a sequence --out gives planes.png of each");
  if (!a.output.report.empty()) return invalid("--report: is of one frame, not of a sequence");
  if (from_stdin) {
    if (!a.fps.empty()) return invalid("--fps: frames named on stdin come when they come");
    return read_names(camera, a.drop.value_or(true));
  }
  if (a.fps.empty()) {
    if (a.drop.value_or(false)) return invalid("--drop: needs frames that do not wait: --fps, or names on stdin");
    return play(std::move(frames));
  }
  const auto fps = parse_number(a.fps);
  if (!fps || !(*fps >= 1e-3 && *fps <= 1e6)) return invalid(fmt::format("--fps: {}, must be in 0.001..1000000 [1/s]", a.fps));
  return play_at(std::move(frames), *fps, a.drop.value_or(true));
}

int run_frames(const PerceiveArguments& arguments) {
  SequenceJob job;
  if (auto ok = arguments.fit.apply(job.options.fit); !ok) return complain(ok.error());
  if (auto ok = arguments.scene.apply(job.options); !ok) return complain(ok.error());
  auto next = source(arguments);
  if (!next) return complain(next.error());
  job.next = std::move(*next);
  job.output = arguments.output;
  return run_sequence(job);
}

int run(const PerceiveArguments& arguments, const CLI::App& app) {
  const bool alone =
      arguments.color.empty() && arguments.depth.empty() && arguments.left.empty() && arguments.right.empty() && arguments.calib.empty();
  if (alone && is_sequence(arguments.inputs)) return run_frames(arguments);
  if (!arguments.fps.empty() || arguments.drop)
    return complain(
        {Error::Kind::invalid_option, "--fps and --drop are for a sequence: several INPUTs, a folder, or - for names on stdin"});
  PerceiveJob job;
  if (auto ok = arguments.fit.apply(job.options.fit); !ok) return complain(ok.error());
  if (auto ok = arguments.scene.apply(job.options); !ok) return complain(ok.error());
  auto read = reader(arguments);
  if (!read) return complain(read.error());
  job.read = std::move(*read);
  job.input = !arguments.inputs.empty() ? arguments.inputs.front() : !arguments.depth.empty() ? arguments.depth : arguments.left;
  job.output = arguments.output;
  job.notes = report_notes(app, std::filesystem::path(job.input).filename().string());
  return run_perceive(job);
}

}  // namespace

int run_perceive(const PerceiveJob& job) {
  if (auto ok = job.output.check(); !ok) return complain(ok.error());
  const Interrupt interrupt;
  PerceiveResult result;
  SearchRecord search;
  Cloud input;
  {
    Progress progress(job.output.quiet);
    progress.say("making the back end ready");
    auto perceiver = Perceiver::create(job.options);
    if (!perceiver) return complain(perceiver.error());

    progress.say("reading " + job.input);
    const Stopwatch loading;
    auto cloud = job.read();
    if (!cloud) return complain(cloud.error());
    input = std::move(*cloud);
    const double load_ms = loading.ms();

    progress.say("perceiving");
    std::size_t found = 0;
    if (!job.output.report.empty()) perceiver->observe([&](const SwarmStep& step) { search.add(step); });
    const auto on_plane = [&](const Model& plane) {
      ++found;
      search.add(plane);
      progress.step(fmt::format("perceiving, {} planes so far", found), found);
      return Verdict::go_on;
    };
    auto perceived = perceiver->perceive(input, on_plane, interrupt.token());
    if (!perceived) return complain(perceived.error());
    result = std::move(*perceived);
    result.timing_ms.load = load_ms;
    progress.say("writing");
    if (auto ok = write(job, result, input, search); !ok) return complain(ok.error());
  }
  if (job.output.verbose) {
    for (const std::string& line : explanation(result.fit, input)) note(line);
    const auto& t = result.timing_ms;
    note(stages({{"loading", t.load}, {"fit", t.fit}, {"pop-out", t.popout}, {"segment", t.segment}, {"recognise", t.recognise}}));
  }
  if (!job.output.quiet) {
    fmt::print("{}", summary(result, input));
    if (job.more) fmt::print("{}", job.more(result, input));
    if (!job.output.out.empty())
      fmt::print("written to {}: {}\n", job.output.out,
                 input.organised() ? "result.json, planes.png, popout.png, objects.png, overlay.png" : "result.json, labelled.ply");
  }
  return kDone;
}

Command add_perceive(CLI::App& app) {
  auto a = std::make_shared<PerceiveArguments>();
  CLI::App* sub = app.add_subcommand("perceive", "The whole chain: supporting planes, what sticks out of them, its outline, its name");
  sub->add_option(
         "input", a->inputs,
         "A cloud: .pcd .ply .xyz .csv; organised and coloured, outlines are found too. Several, a folder, or - for names on stdin: "
         "a sequence, one line of JSON a frame")
      ->type_name("INPUT")
      ->expected(0, -1);
  const char* rgbd = "Instead of INPUT: an RGB-D frame";
  sub->add_option("--color", a->color, "Colour image, registered to the depth image")->type_name("FILE")->group(rgbd);
  sub->add_option("--depth", a->depth, "16-bit depth PNG; 0 is a hole")->type_name("FILE")->group(rgbd);
  a->camera.add_to(*sub);
  const char* stereo = "Instead of INPUT: a rectified stereo pair";
  sub->add_option("--left", a->left, "Left image")->type_name("FILE")->group(stereo);
  sub->add_option("--right", a->right, "Right image")->type_name("FILE")->group(stereo);
  sub->add_option("--calib", a->calib, "Middlebury's calib.txt: cam0, doffs, baseline [mm], ndisp")->type_name("FILE")->group(stereo);
  const char* sequence = "A sequence";
  sub->add_option("--fps", a->fps, "Files come as from a camera, so many a second [as fast as they are worked on]")
      ->type_name("RATE")
      ->group(sequence);
  sub->add_flag_callback(
         "--drop", [a] { a->drop = true; }, "Frames that come too fast are left out [so with --fps and names on stdin]")
      ->group(sequence);
  sub->add_flag_callback(
         "--no-drop", [a] { a->drop = false; }, "They wait at their source instead")
      ->group(sequence);
  a->scene.add_to(*sub);
  a->fit.add_to(*sub);
  a->output.add_to(*sub,
                   "A folder for result.json, planes.png, popout.png, objects.png and overlay.png to look at; labelled.ply for a cloud "
                   "with no image grid. For a sequence, a folder for each frame in it");
  sub->footer(
      "examples:\n"
      "  swarmfit perceive table.pcd --out result\n"
      "  swarmfit perceive table.pcd --report table.html\n"
      "  swarmfit perceive --color c.png --depth d.png --intrinsics 613,613,322,248 --depth-scale 0.001 --out result\n"
      "  swarmfit perceive --left im0.png --right im1.png --calib calib.txt --gallery objects --out result\n"
      "  swarmfit perceive frames/ > frames.jsonl                                 all clouds of a folder, planes and things by their ids\n"
      "  swarmfit perceive rgbd/ --intrinsics 613,613,322,248 --out results       pairs like 7.color.png, 7.depth.png\n"
      "  camera-driver | swarmfit perceive - --gravity 0,1,0                      names of frames as they come");
  return {sub, [a, sub] { return run(*a, *sub); }};
}

}  // namespace swarmfit::cli
