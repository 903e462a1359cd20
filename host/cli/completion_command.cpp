// swarmfit completion SHELL
#include <cstdio>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "host/cli/commands.hpp"
#include "host/cli/console.hpp"
#include "host/cli/help_tree.hpp"

namespace swarmfit::cli {
namespace {

using Kind = Suggestion::Kind;

/// In single quotes, for any of the three shells.
std::string quoted(const std::string& text, const char* quote) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string(quote) : std::string(1, c);
  return out + "'";
}

std::vector<std::string> names_of(const std::vector<OptionHelp>& options) {
  std::vector<std::string> names;
  for (const auto& option : options) names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

// Bash.

constexpr const char* kBash = R"(
_swarmfit() {
  local cur=${COMP_WORDS[COMP_CWORD]} command='' expects='' place=1 i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    if [[ -z $command ]]; then
      [[ ${COMP_WORDS[i]} == -* ]] || command=${COMP_WORDS[i]}
    elif [[ ${COMP_WORDS[i]} != -* ]]; then
      ((place++))
    elif expects=$(_swarmfit_value "$command" "${COMP_WORDS[i]}"); then
      ((++i == COMP_CWORD)) || expects=''
    fi
  done
  if [[ -z $expects && $cur != -* ]]; then
    expects=$(_swarmfit_value "$command" "$place")
  fi
  if [[ -z $expects ]]; then
    expects=$(_swarmfit_options "$command")
  fi
  case $expects in
    @any) ;;
    @file) compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -f -- "$cur") ;;
    @dir) compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -d -- "$cur") ;;
    *) mapfile -t COMPREPLY < <(compgen -W "$expects" -- "$cur") ;;
  esac
}
complete -F _swarmfit swarmfit
)";

std::string bash_value(const OptionHelp& option) {
  const Suggestion what = suggestion(option);
  switch (what.kind) {
    case Kind::words: return fmt::format("'{}'", fmt::join(what.words, " "));
    case Kind::file: return "@file";
    case Kind::folder: return "@dir";
    case Kind::anything: break;
  }
  return "@any";
}

std::string bash(const CommandHelp& help) {
  std::vector<std::string> commands;
  for (const auto& command : help.commands) commands.push_back(command.name);
  std::string values = fmt::format("    ' 1') echo '{}' ;;\n", fmt::join(commands, " "));
  std::string options = fmt::format("    '') echo '{}' ;;\n", fmt::join(names_of(help.options), " "));
  for (const auto& command : help.commands) {
    options += fmt::format("    {}) echo '{}' ;;\n", command.name, fmt::join(names_of(command.options), " "));
    for (const auto& option : command.options) {
      for (const auto& name : option.names) {
        if (option.takes_value) values += fmt::format("    '{} {}') echo {} ;;\n", command.name, name, bash_value(option));
      }
    }
    for (std::size_t k = 0; k < command.arguments.size(); ++k) {
      values += fmt::format("    '{} {}') echo {} ;;\n", command.name, k + 1, bash_value(command.arguments[k]));
    }
  }
  return "# Completion of swarmfit for bash; from `swarmfit completion bash`.\n"
         "# What stands after an option, or at a place, of a command.\n_swarmfit_value() {\n  case \"$1 $2\" in\n" +
         values + "    *) return 1 ;;\n  esac\n}\n_swarmfit_options() {\n  case $1 in\n" + options + "  esac\n}" + kBash;
}

// Zsh.

std::string zsh_words(std::string text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == '\\' || c == ':') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_action(const OptionHelp& option) {
  const Suggestion what = suggestion(option);
  switch (what.kind) {
    case Kind::words: return fmt::format(":{}:({})", zsh_words(option.value), fmt::join(what.words, " "));
    case Kind::file: return fmt::format(":{}:_files", zsh_words(option.value));
    case Kind::folder: return fmt::format(":{}:_files -/", zsh_words(option.value));
    case Kind::anything: break;
  }
  return fmt::format(":{}: ", zsh_words(option.value));
}

std::string zsh_options(const CommandHelp& help, const char* indent) {
  std::string out;
  for (const auto& option : help.options) {
    for (const auto& name : option.names) {
      const std::string spec = fmt::format("{}[{}]{}", name, zsh_words(option.about), option.takes_value ? zsh_action(option) : "");
      out += fmt::format(" \\\n{}{}", indent, quoted(spec, R"('\'')"));
    }
  }
  for (std::size_t k = 0; k < help.arguments.size(); ++k) {
    out += fmt::format(" \\\n{}{}", indent, quoted(fmt::format("{}{}", k + 1, zsh_action(help.arguments[k])), R"('\'')"));
  }
  return out;
}

std::string zsh(const CommandHelp& help) {
  std::string out =
      "#compdef swarmfit\n# Completion of swarmfit for zsh; from `swarmfit completion zsh`.\n"
      "_swarmfit() {\n  local curcontext=$curcontext state line\n  local -a commands\n  commands=(\n";
  for (const auto& command : help.commands) {
    out += fmt::format("    {}\n", quoted(command.name + ":" + zsh_words(command.about), R"('\'')"));
  }
  out += "  )\n  _arguments -C" + zsh_options(help, "    ") +
         " \\\n    '1:command:->command' \\\n    '*::argument:->argument' && return\n"
         "  case $state in\n    command) _describe -t commands command commands ;;\n    argument)\n      case $words[1] in\n";
  for (const auto& command : help.commands) {
    out += fmt::format("        {}) _arguments{} ;;\n", command.name, zsh_options(command, "          "));
  }
  // Autoloaded, the file is the function's body and runs it; sourced, it registers it.
  return out +
         "      esac ;;\n  esac\n}\nif [[ $funcstack[1] == _swarmfit ]]; then _swarmfit \"$@\"; else compdef _swarmfit swarmfit; fi\n";
}

// Fish.

std::string fish_action(const OptionHelp& option) {
  const Suggestion what = suggestion(option);
  switch (what.kind) {
    case Kind::words: return fmt::format(" -x -a '{}'", fmt::join(what.words, " "));
    case Kind::file: return " -r -F";
    case Kind::folder: return " -x -a '(__fish_complete_directories)'";
    case Kind::anything: break;
  }
  return " -x";
}

std::string fish_options(const CommandHelp& help, const std::string& condition) {
  std::string out;
  for (const auto& option : help.options) {
    out += "complete -c swarmfit -n " + condition;
    for (const auto& name : option.names) out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    out += fmt::format("{} -d {}\n", option.takes_value ? fish_action(option) : "", quoted(option.about, R"(\')"));
  }
  for (const auto& argument : help.arguments) {
    const Suggestion what = suggestion(argument);
    if (what.kind == Kind::words)
      out += fmt::format("complete -c swarmfit -n {} -a '{}' -d {}\n", condition, fmt::join(what.words, " "), argument.value);
    if (what.kind == Kind::file || what.kind == Kind::folder) out += fmt::format("complete -c swarmfit -n {} -F\n", condition);
  }
  return out;
}

std::string fish(const CommandHelp& help) {
  std::string out = "# Completion of swarmfit for fish; from `swarmfit completion fish`.\ncomplete -c swarmfit -f\n";
  for (const auto& command : help.commands) {
    out += fmt::format("complete -c swarmfit -n __fish_use_subcommand -a {} -d {}\n", command.name, quoted(command.about, R"(\')"));
  }
  out += fish_options(help, "__fish_use_subcommand");
  for (const auto& command : help.commands) {
    out += fish_options(command, fmt::format("'__fish_seen_subcommand_from {}'", command.name));
  }
  return out;
}

int run(const CLI::App& app, const std::string& shell) {
  std::string (*const script)(const CommandHelp&) = shell == "bash" ? bash : shell == "zsh" ? zsh : shell == "fish" ? fish : nullptr;
  if (!script) return wrong_usage(fmt::format("{}: not known; must be one of bash, zsh, fish", shell));
  fmt::print("{}", script(help_tree(app)));
  return kDone;
}

}  // namespace

Command add_completion(CLI::App& app) {
  auto shell = std::make_shared<std::string>();
  CLI::App* sub = app.add_subcommand("completion", "A script that lets a shell complete this command's line");
  sub->add_option("shell", *shell, "Whose: bash, zsh or fish")->type_name("bash|zsh|fish")->required();
  sub->footer(
      "Installed, the scripts lie where these shells look. Otherwise:\n"
      "  bash: source <(swarmfit completion bash)\n"
      "  zsh:  source <(swarmfit completion zsh)      after compinit\n"
      "  fish: swarmfit completion fish | source");
  return {sub, [&app, shell] { return run(app, *shell); }};
}

}  // namespace swarmfit::cli
