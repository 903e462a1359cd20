#include "host/cli/html_report.hpp"

#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <swarmfit/results.hpp>

#include "host/cli/options.hpp"
#include "host/cli/process.hpp"

namespace swarmfit::cli {

ReportNotes report_notes(const CLI::App& subcommand, const std::string& inputs) {
  ReportNotes notes;
  notes.title = fmt::format("{} {}", subcommand.get_name(), inputs);
  notes.command = remembered_command();
  for (const CLI::Option* option : subcommand.get_options()) {
    if (option->get_lnames().empty() || option->get_group() == OutputFlags::kGroup || option->get_lnames().front() == "help") continue;
    const bool given = option->count() > 0;
    const std::string value = given ? fmt::format("{}", fmt::join(option->results(), " ")) : option->get_default_str();
    const bool of_interest = given || (!value.empty() && option->get_group() == FitFlags::kGroup);
    if (of_interest) notes.settings.push_back({"--" + option->get_lnames().front(), value, given});
  }
  return notes;
}

Expected<> write_report(const std::string& file, const Expected<std::string>& page) {
  if (!page) return tl::unexpected(page.error());
  return write_text(file, *page);
}

}  // namespace swarmfit::cli
