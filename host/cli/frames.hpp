// Where the frames of a sequence come from: a folder, a list, or names on stdin as they come.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <swarmfit/cloud.hpp>

#include "host/cli/depth_camera.hpp"

namespace swarmfit::cli {

/// One frame, not yet read.
struct FrameRef {
  std::size_t index = 0;  ///< counts what the source gave, dropped frames included
  std::string name;       ///< of its line and its folder
  std::string input;      ///< what is read, for messages
  std::function<Expected<Cloud>()> read;
};

/// Waits for the next frame; nothing at the end, or once asked to stop. A gap in `index`: frames that were dropped.
using FrameSource = std::function<std::optional<FrameRef>(const std::stop_token&)>;

/// A file's ending in small letters, with its dot.
std::string ending_of(const std::filesystem::path& file);

/// Is this more than one frame: several inputs, a folder, or `-`?
bool is_sequence(const std::vector<std::string>& inputs);

/// Every frame of the inputs in order; folders by name, numbers in names by value: clouds, or else pairs like 7.color.png, 7.depth.png.
/// Fails with bad_input: a folder that holds no frame; invalid_option: depth images without a camera.
Expected<std::vector<FrameRef>> list_frames(const std::vector<std::string>& inputs, const std::optional<DepthCamera>& camera);

/// One after another as fast as they are asked for.
FrameSource play(std::vector<FrameRef> frames);
/// As a camera would give them, `fps` a second. With `drop` those that are over by the time they are asked for are left out.
FrameSource play_at(std::vector<FrameRef> frames, double fps, bool drop);
/// Names on stdin, one a line, until it ends. With `drop` only the latest of those that wait is taken.
FrameSource read_names(std::optional<DepthCamera> camera, bool drop);

}  // namespace swarmfit::cli
