#include "host/cli/options.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>

#include "host/cli/console.hpp"

namespace swarmfit::cli {
namespace {

tl::unexpected<Error> invalid(std::string message) { return fail(Error::Kind::invalid_option, std::move(message)); }

/// A whole number within bounds, into `value`; empty text leaves it as it is.
template <class Value, class Whole>
Expected<> whole(const std::string& option, const std::string& text, Whole least, Whole most, Value& value) {
  if (text.empty()) return {};
  Whole number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < least || number > most) {
    return invalid(fmt::format("{}: {}, must be a whole number in {}..{}", option, text, least, most));
  }
  value = number;
  return {};
}

/// A finite number above zero, into `value`; empty text leaves it as it is.
template <class Value>
Expected<> positive(const std::string& option, const std::string& text, const std::string& unit, Value& value) {
  if (text.empty()) return {};
  const auto number = parse_number(text);
  if (!number || !(*number > 0) || !std::isfinite(*number))
    return invalid(fmt::format("{}: {}, must be a number > 0{}", option, text, unit));
  value = *number;
  return {};
}

/// Beyond these a float holds no tau, or not what many points of it add up to.
constexpr double kLeastThreshold = 1e-30, kMostThreshold = 1e30;

/// A --threshold other than auto, into `value`.
Expected<> threshold_of(const std::string& text, std::optional<double>& value) {
  const auto number = parse_number(text);
  if (!number) return invalid(fmt::format("--threshold: {}, must be a number > 0 or auto", text));
  if (auto ok = positive("--threshold", text, " in the data's unit", value); !ok) return ok;
  if (*number >= kLeastThreshold && *number <= kMostThreshold) return {};
  return invalid(fmt::format("--threshold: {}, must be in {}..{} in the data's unit", text, kLeastThreshold, kMostThreshold));
}

}  // namespace

std::optional<double> parse_number(const std::string& text) {
  double value = 0;
  const char* first = text.data() + (text.size() > 1 && text[0] == '+' ? 1 : 0);
  const auto [end, error] = std::from_chars(first, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

Expected<std::vector<double>> parse_list(const std::string& option, const std::string& text, const std::string& form, std::size_t count) {
  std::vector<double> values;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const auto value = parse_number(text.substr(start, comma - start));
    if (!value || !std::isfinite(*value)) return invalid(fmt::format("{}: {}, must be numbers of the form {}", option, text, form));
    values.push_back(*value);
    start = comma + 1;
  }
  if (count != 0 && values.size() != count)
    return invalid(fmt::format("{}: {} has {} numbers, must have {}, {}", option, text, values.size(), count, form));
  return values;
}

void FitFlags::add_to(CLI::App& app, const std::string& default_threshold) {
  const char* group = kGroup;
  app.add_option("--threshold", threshold,
                 "Inliers are within this distance, in the data's unit; auto: from the data's own noise [" + default_threshold + "]")
      ->type_name("VALUE|auto")
      ->group(group);
  app.add_option("--backend", backend, "auto, cpu, vulkan, reference, or part of a device's name; see swarmfit devices")
      ->type_name("NAME")
      ->group(group)
      ->capture_default_str();
  app.add_option("--threads", threads, "Threads of the CPU back end; 0: all")->type_name("N")->group(group)->capture_default_str();
  app.add_option("--seed", seed, "The same seed gives the same result")->type_name("N")->group(group)->capture_default_str();
  app.add_option("--preset", preset, "fast: what measures best; paper: Zhou et al. 2010")
      ->type_name("fast|paper")
      ->group(group)
      ->capture_default_str();
  app.add_option("--particles", particles, "Size of the swarm, >= 2")->type_name("N")->group(group);
  app.add_option("--iterations", iterations, "Most steps of one swarm")->type_name("N")->group(group);
  app.add_option("--stall", stall, "Converged when the best has not moved for this many steps")->type_name("N")->group(group);
  app.add_option("--deflation", deflation, "How found models are left behind: by what they explain, or by their parameters")
      ->type_name("residual|parametric")
      ->group(group);
  app.add_option("--lambda", lambda, "Strength of parametric deflation, > 0")->type_name("VALUE")->group(group);
  app.add_option("--min-inliers", min_inliers, "A model has at least this many [from the data]")->type_name("N")->group(group);
  app.add_option("--max-models", max_models, "Stop after this many [no bound]")->type_name("N")->group(group);
  app.add_option("--time-budget", time_budget, "Stop after this time; what is found by then is valid [none]")
      ->type_name("MS")
      ->group(group);
}

Expected<> FitFlags::apply(FitOptions& options) const {
  if (threshold == "auto") {
    options.estimate_threshold = true;
  } else if (!threshold.empty()) {
    if (auto ok = threshold_of(threshold, options.threshold); !ok) return ok;
  }
  if (preset != "fast" && preset != "paper") return invalid(fmt::format("--preset: {}, must be fast or paper", preset));
  options.preset = preset == "fast" ? Preset::fast : Preset::paper;
  if (!deflation.empty() && deflation != "residual" && deflation != "parametric") {
    return invalid(fmt::format("--deflation: {}, must be residual or parametric", deflation));
  }
  if (!deflation.empty()) options.deflation = deflation == "residual" ? Deflation::residual : Deflation::parametric;
  if (backend.empty()) return invalid("--backend: empty, must be auto, cpu, vulkan, reference, or part of a device's name");
  options.backend = backend;
  options.pipeline_cache = pipeline_cache_folder();

  constexpr int kMost = 1'000'000'000;
  constexpr std::size_t kMany = std::size_t{1} << 32;
  Expected<> checks[] = {
      whole("--particles", particles, 2, 1'000'000, options.particles),
      whole("--iterations", iterations, 1, kMost, options.iterations),
      whole("--stall", stall, 1, kMost, options.stall),
      whole("--threads", threads, 0, 4096, options.threads),
      whole("--seed", seed, std::uint64_t{0}, std::numeric_limits<std::uint64_t>::max(), options.seed),
      whole("--min-inliers", min_inliers, std::size_t{1}, kMany, options.min_inliers),
      whole("--max-models", max_models, std::size_t{1}, std::size_t{65534}, options.max_models),
      positive("--lambda", lambda, "", options.lambda),
      positive("--time-budget", time_budget, " [ms]", options.time_budget_ms),
  };
  for (auto& check : checks) {
    if (!check) return check;
  }
  return options.validate();
}

std::string file_or_stdout(const std::string& file, bool& quiet) {
  if (file != "-") return file;
  quiet = true;  // a summary would be in the way
  return "/dev/stdout";
}

void OutputFlags::add_to(CLI::App& app, const std::string& out_help) {
  const char* group = kGroup;
  const auto to_stdout = [this](const std::string& file) { return file_or_stdout(file, quiet); };
  app.add_option("--json", json, "The result as JSON: models, their parameters and covariance, times; - for standard output, alone")
      ->transform(to_stdout)
      ->type_name("FILE")
      ->group(group);
  app.add_option("--labels", labels, "Text, a whole number a line, a line a point: 0 none, k the k-th model; - as for --json")
      ->transform(to_stdout)
      ->type_name("FILE")
      ->group(group);
  app.add_option("--out", out, out_help)->type_name("DIR")->group(group);
  app.add_option("--report", report, "One HTML page to look at: the cloud in 3D, the search replayed, the image, the numbers")
      ->type_name("FILE")
      ->group(group);
  app.add_flag("--quiet", quiet, "No summary, no progress")->group(group);
  app.add_flag("--verbose", verbose, "What was decided on the way, and the time of each stage, on stderr")->group(group);
}

Expected<> OutputFlags::check() const {
  if (!report.empty()) {
    if (auto ok = check_report(); !ok) return ok;
  }
  for (const auto& file : {json, labels, report}) {
    if (file.empty()) continue;
    if (auto ok = check_writable(file); !ok) return ok;
  }
  if (!out.empty()) return check_writable_folder(out);
  return {};
}

void VerticalFlags::add_to(CLI::App& app, const std::string& group, const std::string& with_neither) {
  app.add_option("--gravity", gravity, "Direction of gravity in the camera's frame (x right, y down, z forward)")
      ->type_name("X,Y,Z")
      ->group(group);
  app.add_option("--camera-tilt", camera_tilt, "The camera looks down by this much; " + with_neither)->type_name("DEG")->group(group);
}

Expected<> VerticalFlags::apply(PerceiveOptions& options) const {
  if (!gravity.empty() && !camera_tilt.empty()) return invalid("--gravity and --camera-tilt exclude each other");
  if (!gravity.empty()) {
    const auto g = parse_list("--gravity", gravity, "X,Y,Z", 3);
    if (!g) return tl::unexpected(g.error());
    options.gravity = Eigen::Vector3d((*g)[0], (*g)[1], (*g)[2]);
    if (!(options.gravity->norm() > 0)) return invalid(fmt::format("--gravity: {}, must not be zero", gravity));
  }
  if (!camera_tilt.empty()) {
    const auto tilt = parse_number(camera_tilt);
    if (!tilt || !(std::abs(*tilt) <= 90)) return invalid(fmt::format("--camera-tilt: {}, must be in -90..90 [degrees]", camera_tilt));
    options.camera_tilt = *tilt * std::numbers::pi / 180;
  }
  return {};
}

Expected<Eigen::Vector3d> VerticalFlags::axis() const {
  PerceiveOptions parsed;
  if (auto ok = apply(parsed); !ok) return tl::unexpected(ok.error());
  if (parsed.gravity) return *parsed.gravity;
  return Eigen::Vector3d(0, std::cos(*parsed.camera_tilt), std::sin(*parsed.camera_tilt));
}

void SceneFlags::add_to(CLI::App& app) {
  const char* group = "What is known of the scene";
  vertical.add_to(app, group, "with neither, the dominant plane is the ground");
  app.add_option("--segmentation", segmentation,
                 "How things are outlined in the image: graphcut labels pixels, fixation draws a contour around each thing's centre")
      ->type_name("graphcut|fixation")
      ->group(group)
      ->capture_default_str();
  app.add_option("--gallery", gallery, "Names for what is found: one image, or one folder of images, a name")
      ->type_name("DIR")
      ->group(group);
}

Expected<> SceneFlags::apply(PerceiveOptions& options) const {
  if (auto ok = vertical.apply(options); !ok) return ok;
  if (segmentation != "graphcut" && segmentation != "fixation")
    return invalid(fmt::format("--segmentation: {}, must be graphcut or fixation", segmentation));
  options.segmentation = segmentation == "graphcut" ? Segmentation::graphcut : Segmentation::fixation;
  options.gallery = gallery;
  return options.validate();
}

void CameraFlags::add_to(CLI::App& app) {
  const char* group = "The camera of a depth image";
  app.add_option("--intrinsics", intrinsics, "Focal lengths and principal point [px]")->type_name("FX,FY,CX,CY")->group(group);
  app.add_option("--depth-scale", depth_scale, "Metres a unit of depth")->type_name("S")->group(group)->capture_default_str();
}

Expected<DepthCamera> CameraFlags::camera() const {
  if (intrinsics.empty()) return invalid("--intrinsics FX,FY,CX,CY is needed with a depth image");
  const auto k = parse_list("--intrinsics", intrinsics, "FX,FY,CX,CY", 4);
  if (!k) return tl::unexpected(k.error());
  if (!((*k)[0] > 0 && (*k)[1] > 0)) return invalid(fmt::format("--intrinsics: {}, focal lengths must be > 0 [px]", intrinsics));
  DepthCamera camera{{(*k)[0], (*k)[1], (*k)[2], (*k)[3]}};
  if (depth_scale.empty()) return invalid("--depth-scale: empty, must be a number > 0 [m a unit]");
  if (auto ok = positive("--depth-scale", depth_scale, " [m a unit]", camera.scale); !ok) return tl::unexpected(ok.error());
  return camera;
}

}  // namespace swarmfit::cli
