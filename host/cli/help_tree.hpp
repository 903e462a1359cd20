// What `swarmfit --help` knows, as data: shell completion and the man page are written from it.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace swarmfit::cli {

struct OptionHelp {
  std::vector<std::string> names;  ///< "-h", "--help"; of an argument without dashes, its name
  std::string value;               ///< "FILE", "fast|paper"; empty for a flag
  std::string fallback;            ///< what it is where it is not given, if the help says so
  std::string about, group;
  bool takes_value = false, required = false;
};

struct CommandHelp {
  std::string name, about, footer;
  std::vector<OptionHelp> arguments, options;
  std::vector<CommandHelp> commands;
};

/// Hidden commands and options are left out, as in the help.
CommandHelp help_tree(const CLI::App& app);

/// What may stand for a value, as far as a shell can help with it.
struct Suggestion {
  enum class Kind { words, file, folder, anything } kind = Kind::anything;
  std::vector<std::string> words;
};
Suggestion suggestion(const OptionHelp& option);

}  // namespace swarmfit::cli
