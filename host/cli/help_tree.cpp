#include "host/cli/help_tree.hpp"

#include <algorithm>
#include <string_view>

#include <swarmfit/model.hpp>

namespace swarmfit::cli {
namespace {

OptionHelp help_of(const CLI::Option& option) {
  OptionHelp help;
  for (const auto& name : option.get_snames()) help.names.push_back("-" + name);
  for (const auto& name : option.get_lnames()) help.names.push_back("--" + name);
  if (help.names.empty()) help.names.push_back(option.get_name(true));
  help.takes_value = option.get_items_expected_max() > 0;
  if (help.takes_value) {
    help.value = option.get_type_name();
    help.fallback = option.get_default_str();
  }
  help.about = option.get_description();
  help.group = option.get_group();
  help.required = option.get_required();
  return help;
}

std::vector<std::string> split(std::string_view text, char at) {
  std::vector<std::string> parts;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(at, start), text.size());
    parts.emplace_back(text.substr(start, end - start));
    start = end + 1;
  }
  return parts;
}

bool is_literal(const std::string& word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; });
}

}  // namespace

CommandHelp help_tree(const CLI::App& app) {
  CommandHelp help{app.get_name(), app.get_description(), app.get_footer(), {}, {}, {}};
  for (const CLI::Option* option : app.get_options({})) {
    if (option->get_group().empty()) continue;
    (option->get_positional() && option->get_lnames().empty() ? help.arguments : help.options).push_back(help_of(*option));
  }
  for (const CLI::App* command : app.get_subcommands([](const CLI::App* c) { return !c->get_group().empty(); })) {
    help.commands.push_back(help_tree(*command));
  }
  return help;
}

Suggestion suggestion(const OptionHelp& option) {
  Suggestion what;
  if (option.value.starts_with("MODEL")) {
    what.kind = Suggestion::Kind::words;
    for (const ModelType type : model_types()) what.words.emplace_back(name(type));
    return what;
  }
  if (option.names.back() == "--backend") return {Suggestion::Kind::words, {"auto", "cpu", "vulkan", "reference"}};
  for (const std::string& form : split(option.value, '|')) {
    if (form == "DIR") return {Suggestion::Kind::folder, {}};
    if (form == "FILE" || form.starts_with("INPUT")) return {Suggestion::Kind::file, {}};
    if (is_literal(form)) what.words.push_back(form);
  }
  if (!what.words.empty()) what.kind = Suggestion::Kind::words;
  return what;
}

}  // namespace swarmfit::cli
