// Help as a terminal of 80 columns shows it.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace swarmfit::cli {

/// The text in lines of at most 80 columns, where words allow it: a description goes on below where it began, a command after a backslash.
std::string folded(const std::string& text);

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    return folded(Formatter::make_help(app, std::move(name), mode));
  }
};

}  // namespace swarmfit::cli
