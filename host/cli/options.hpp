// Options that several subcommands share, and how their text becomes the library's.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <swarmfit/cloud.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

#include "host/cli/depth_camera.hpp"

namespace swarmfit::cli {

/// A number, or nothing where the text is not one. NaN and infinity are numbers here; whoever reads them says what is allowed.
std::optional<double> parse_number(const std::string& text);
/// `count` numbers parted by commas. Fails with invalid_option, naming the option and the form it has.
Expected<std::vector<double>> parse_list(const std::string& option, const std::string& text, const std::string& form, std::size_t count);

/// How models are found: given to fit, perceive, learn and demo.
struct FitFlags {
  static constexpr const char* kGroup = "How models are found";
  std::string threshold, preset = "fast", deflation, backend = "auto", particles, iterations, stall, lambda, min_inliers, max_models,
                         time_budget, threads = "0", seed = "1";

  /// What --threshold is where it is not given, in planes of frames.
  static constexpr const char* kOfFrames = "0.01; a stereo pair: 0.015";

  /// `default_threshold`: what --threshold is where it is not given, in words.
  void add_to(CLI::App& app, const std::string& default_threshold = kOfFrames);
  /// Into `options`; what is not given keeps its value. Fails with invalid_option.
  Expected<> apply(FitOptions& options) const;
};

/// What is given as a file to write: "-" is standard output, where nothing else is to be said then.
std::string file_or_stdout(const std::string& file, bool& quiet);

/// Where results go.
struct OutputFlags {
  static constexpr const char* kGroup = "Where results go";
  std::string json, labels, out, report;
  bool quiet = false, verbose = false;

  void add_to(CLI::App& app, const std::string& out_help);
  /// Fails with cannot_write, before any work is done; also where this build can write no report.
  Expected<> check() const;
};

/// Which way is up: given to fit, perceive and demo.
struct VerticalFlags {
  std::string gravity, camera_tilt;

  void add_to(CLI::App& app, const std::string& group, const std::string& with_neither);
  bool given() const noexcept { return !gravity.empty() || !camera_tilt.empty(); }
  /// Into gravity or camera_tilt of `options`. Fails with invalid_option.
  Expected<> apply(PerceiveOptions& options) const;
  /// The vertical's direction, in the camera's frame. Only where given.
  Expected<Eigen::Vector3d> axis() const;
};

/// Which way is up, how things are outlined, and what is known by name: given to perceive and demo.
struct SceneFlags {
  VerticalFlags vertical;
  std::string segmentation = "graphcut", gallery;

  void add_to(CLI::App& app);
  Expected<> apply(PerceiveOptions& options) const;
};

/// The pinhole camera behind a depth image.
struct CameraFlags {
  std::string intrinsics, depth_scale = "0.001";

  void add_to(CLI::App& app);
  /// Fails with invalid_option: not given, not four numbers, out of bounds.
  Expected<DepthCamera> camera() const;
};

}  // namespace swarmfit::cli
