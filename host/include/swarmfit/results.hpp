// Results as files: result.json, label files, images to look at. Each file appears whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit {

/// result.json, schema 1. `load_ms`: time spent reading the input.
SWARMFIT_API std::string to_json(const FitResult& result, const Cloud& input, double load_ms);
SWARMFIT_API std::string to_json(const PerceiveResult& result, const Cloud& input);
/// The same on one line, for one frame of a sequence; `frame` holds its index and name. Ends with a line's end.
SWARMFIT_API std::string to_json_line(const PerceiveResult& result, const Cloud& input, std::size_t index, const std::string& name);

/// Could `file` be written, could `folder` be made and written to? To ask before the work is done; leaves nothing behind.
SWARMFIT_API Expected<> check_writable(const std::filesystem::path& file);
SWARMFIT_API Expected<> check_writable_folder(const std::filesystem::path& folder);

/// Writes through a temporary file beside `file` and a rename. Fails with cannot_write, leaving nothing behind.
SWARMFIT_API Expected<> write_text(const std::filesystem::path& file, const std::string& text);
/// One integer a line, one line a point, in input order.
SWARMFIT_API Expected<> write_labels(const std::filesystem::path& file, const std::vector<std::uint16_t>& labels);

/// result.json and, for an organised cloud, planes.png, popout.png, objects.png (16 bit) and overlay.png; else labelled.ply.
/// Makes the folder if need be. Fails with cannot_write and leaves none of these files half written.
SWARMFIT_API Expected<> write_perception(const std::filesystem::path& folder, const PerceiveResult& result, const Cloud& input);

/// 8-bit RGB, 3 bytes a pixel: each plane in its colour, sticking-out points yellow, SOI rectangles, outlines, names.
SWARMFIT_API std::vector<std::uint8_t> render_overlay(const PerceiveResult& result, const Cloud& input);

}  // namespace swarmfit
