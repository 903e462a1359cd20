// swarmfit man: the man page, from the same help. Hidden; the build runs it.
#include <cctype>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include <swarmfit/version.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/help_tree.hpp"

namespace swarmfit::cli {
namespace {

/// As roff reads it: a backslash and a hyphen are themselves, and no line starts a request.
std::string roff(const std::string& text) {
  std::string out;
  bool line_starts = true;
  for (const char c : text) {
    if (line_starts && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    line_starts = c == '\n';
  }
  return out;
}

/// Lines as they are; empty ones part paragraphs.
std::string as_written(const std::string& text) {
  if (text.empty()) return {};
  std::string out = ".PP\n.nf\n";
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    out += end == start ? ".sp\n" : roff(text.substr(start, end - start)) + "\n";
    start = end + 1;
  }
  return out + ".fi\n";
}

std::string entry(const OptionHelp& option) {
  std::string out = ".TP\n";
  for (std::size_t k = 0; k < option.names.size(); ++k) {
    const bool dashes = option.names[k].starts_with('-');
    out += fmt::format("{}{}", k ? ", " : "", dashes ? "\\fB" + roff(option.names[k]) + "\\fR" : "");
  }
  if (!option.value.empty()) out += fmt::format("{}\\fI{}\\fR", out.ends_with('\n') ? "" : " ", roff(option.value));
  out += "\n" + roff(option.about) + ".\n";
  if (!option.fallback.empty()) out += fmt::format("Default: {}.\n", roff(option.fallback));
  return out;
}

std::string section(const CommandHelp& command) {
  std::string synopsis = "swarmfit " + command.name;
  for (const auto& argument : command.arguments) synopsis += argument.required ? " " + argument.value : " [" + argument.value + "]";
  std::string out = fmt::format(".SS {} [OPTIONS]\n{}.\n", roff(synopsis), roff(command.about));
  for (const auto& argument : command.arguments) out += entry(argument);
  std::string group = "Options";
  for (const auto& option : command.options) {
    if (option.group != group) out += fmt::format(".PP\n\\fI{}\\fR\n", roff(group = option.group));
    out += entry(option);
  }
  return out + as_written(command.footer);
}

std::string man_page(const CommandHelp& help) {
  const std::size_t colon = help.about.find(": ");
  const std::string brief = colon == std::string::npos ? help.about : help.about.substr(colon + 2);
  std::string out = fmt::format(".\\\" From `swarmfit man`.\n.TH SWARMFIT 1 \"\" \"swarmfit {}.{}.{}\" \"User Commands\"\n",
                                SWARMFIT_VERSION_MAJOR, SWARMFIT_VERSION_MINOR, SWARMFIT_VERSION_PATCH);
  out += fmt::format(".SH NAME\nswarmfit \\- {}\n.SH SYNOPSIS\n.B swarmfit\n.I COMMAND\n[\\fIOPTIONS\\fR]\n", roff(brief));
  out += ".SH DESCRIPTION\n" + roff(help.about) + "\n" + as_written(help.footer) + ".SH OPTIONS\n";
  for (const auto& option : help.options) out += entry(option);
  out += ".SH COMMANDS\n";
  for (const auto& command : help.commands) out += section(command);
  return out +
         ".SH ENVIRONMENT\n"
         ".TP\n\\fBNO_COLOR\\fR\nSet to anything, no colours. There are none in a pipe or a file either.\n"
         ".TP\n\\fBXDG_CACHE_HOME\\fR, \\fBHOME\\fR\nCompiled Vulkan pipelines are kept in the folder swarmfit of the first,\n"
         "or in .cache/swarmfit of the second.\n";
}

}  // namespace

Command add_man(CLI::App& app) {
  CLI::App* sub = app.add_subcommand("man", "The man page, for man(1)")->group("");
  return {sub, [&app] {
            fmt::print("{}", man_page(help_tree(app)));
            return static_cast<int>(kDone);
          }};
}

}  // namespace swarmfit::cli
