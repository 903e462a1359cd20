// swarmfit learn NAME INPUT
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <swarmfit/gallery.hpp>
#include <swarmfit/perception.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/frames.hpp"
#include "host/cli/options.hpp"

namespace swarmfit::cli {
namespace {

struct LearnArguments {
  std::string name, input, color, depth, object, gallery = "swarmfit-gallery";
  bool quiet = false;
  FitFlags fit;
  VerticalFlags vertical;
  CameraFlags camera;
};

bool is_cloud(const std::string& file) {
  const std::string ending = ending_of(file);
  return ending == ".pcd" || ending == ".ply" || ending == ".xyz" || ending == ".csv";
}

Expected<Cloud> read_frame(const LearnArguments& a) {
  if (!a.input.empty()) return read_cloud(a.input);
  const auto camera = a.camera.camera();
  if (!camera) return tl::unexpected(camera.error());
  return read_rgbd(a.color, a.depth, camera->intrinsics, camera->scale);
}

struct Learnt {
  LearntView view;
  std::string what;  ///< it was learnt from
};

Expected<Learnt> learn_from_frame(const LearnArguments& a) {
  PerceiveOptions options;
  if (auto ok = a.fit.apply(options.fit); !ok) return tl::unexpected(ok.error());
  if (auto ok = a.vertical.apply(options); !ok) return tl::unexpected(ok.error());
  std::size_t object = 0;
  if (!a.object.empty()) {
    const auto number = parse_number(a.object);
    if (!number || *number < 1 || *number > 65534 || *number != static_cast<double>(static_cast<int>(*number)))
      return fail(Error::Kind::invalid_option, fmt::format("--object: {}, must be a whole number in 1..65534", a.object));
    object = static_cast<std::size_t>(*number);
  }
  auto perceiver = Perceiver::create(options);
  if (!perceiver) return tl::unexpected(perceiver.error());
  const auto frame = read_frame(a);
  if (!frame) return tl::unexpected(frame.error());
  const auto result = perceiver->perceive(*frame);
  if (!result) return tl::unexpected(result.error());
  auto view = learn_object(a.gallery, a.name, *frame, *result, object);
  if (!view) return tl::unexpected(view.error());
  const std::string which = object == 0 ? std::string("the largest") : fmt::format("object {}", object);
  return Learnt{std::move(*view), fmt::format("{} of {}", which, result->sois.size())};
}

Expected<Learnt> learn(const LearnArguments& a) {
  const bool rgbd = !a.color.empty() || !a.depth.empty();
  if (a.input.empty() == !rgbd || (rgbd && (a.color.empty() || a.depth.empty())))
    return fail(Error::Kind::invalid_option, "learn takes one of: INPUT, or --color and --depth with --intrinsics");
  if (a.gallery.empty()) return fail(Error::Kind::invalid_option, "--gallery: empty, must be a folder");
  if (rgbd || is_cloud(a.input)) return learn_from_frame(a);
  if (!a.object.empty()) return fail(Error::Kind::invalid_option, "--object: is of a frame; an image is learnt as a whole");
  auto view = learn_image(a.gallery, a.name, a.input);
  if (!view) return tl::unexpected(view.error());
  return Learnt{std::move(*view), "an image"};
}

int run(const LearnArguments& arguments) {
  const auto learnt = learn(arguments);
  if (!learnt) return complain(learnt.error());
  if (!arguments.quiet)
    fmt::print("{}: {} features of {}, written to {}; {} view{} of it, {} name{} in {}\n", arguments.name, learnt->view.features,
               learnt->what, learnt->view.file.string(), learnt->view.views, learnt->view.views == 1 ? "" : "s", learnt->view.names,
               learnt->view.names == 1 ? "" : "s", arguments.gallery);
  return kDone;
}

}  // namespace

Command add_learn(CLI::App& app) {
  auto a = std::make_shared<LearnArguments>();
  CLI::App* sub = app.add_subcommand("learn", "Adds a view of a thing to a gallery, for perceive --gallery");
  sub->add_option("name", a->name, "What it is called")->type_name("NAME")->required();
  sub->add_option("input", a->input, "An image of it, transparent where it is not; or an organised coloured cloud it stands out in")
      ->type_name("INPUT");
  sub->add_option("--gallery", a->gallery, "The gallery's folder, made if need be")->type_name("DIR")->capture_default_str();
  sub->add_option("--object", a->object, "Which thing of a frame, as perceive numbers them [the largest in the image]")->type_name("K");
  sub->add_flag("--quiet", a->quiet, "No summary");
  const char* rgbd = "Instead of INPUT: an RGB-D frame";
  sub->add_option("--color", a->color, "Colour image, registered to the depth image")->type_name("FILE")->group(rgbd);
  sub->add_option("--depth", a->depth, "16-bit depth PNG; 0 is a hole")->type_name("FILE")->group(rgbd);
  a->camera.add_to(*sub);
  a->vertical.add_to(*sub, "What is known of the scene", "with neither, the dominant plane is the ground");
  a->fit.add_to(*sub);
  sub->footer(
      "examples:\n"
      "  swarmfit learn milk milk-front.png --gallery things\n"
      "  swarmfit perceive table.pcd --out look           then see in look/overlay.png which one it is\n"
      "  swarmfit learn mug table.pcd --object 3 --gallery things\n"
      "  swarmfit perceive other.pcd --gallery things");
  return {sub, [a] { return run(*a); }};
}

}  // namespace swarmfit::cli
