// What --report tells beside the result: how the command was called.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include <swarmfit/report.hpp>

namespace swarmfit::cli {

/// Title, command line and settings; `inputs`: what was read, as it stands in the title. Settings are the options that a result depends on:
/// those that were given, and how models are found by default.
ReportNotes report_notes(const CLI::App& subcommand, const std::string& inputs);

/// Writes the page. Fails with cannot_write, leaving nothing behind.
Expected<> write_report(const std::string& file, const Expected<std::string>& page);

}  // namespace swarmfit::cli
