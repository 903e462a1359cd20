#include <filesystem>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>

#include "python/src/bindings.hpp"
#include "python/src/errors.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace swarmfit::python {
namespace {

/// Name, value, given by the caller.
using Settings = std::vector<std::tuple<std::string, std::string, bool>>;

ReportNotes notes(std::string title, std::string call, Settings settings) {
  ReportNotes all;
  all.title = std::move(title);
  all.command = std::move(call);
  for (auto& [name, value, given] : settings) all.settings.push_back({std::move(name), std::move(value), given});
  return all;
}

/// Makes the page and writes it, without Python's lock.
template <class MakePage>
void write(const std::filesystem::path& file, const MakePage& make) {
  Expected<> written;
  {
    const nb::gil_scoped_release unlocked;
    const Expected<std::string> page = make();
    written = page ? write_text(file, *page) : Expected<>(tl::unexpected(page.error()));
  }
  value_of(std::move(written));
}

}  // namespace

void bind_reporting(nb::module_& module) {
  nb::class_<SearchRecord>(module, "SearchRecord", "A search to be replayed in a report.").def(nb::init<>());
  module.def(
      "write_fit_report",
      [](const std::filesystem::path& file, const FitResult& result, const Cloud& cloud, const SearchRecord& search, std::string title,
         std::string call, Settings settings) {
        const ReportNotes told = notes(std::move(title), std::move(call), std::move(settings));
        write(file, [&] { return report_page(result, cloud, 0, search, told); });
      },
      "file"_a, "result"_a, "cloud"_a, "search"_a, "title"_a, "call"_a, "settings"_a);
  module.def(
      "write_perceive_report",
      [](const std::filesystem::path& file, const PerceiveResult& result, const Cloud& cloud, const SearchRecord& search, std::string title,
         std::string call, Settings settings) {
        const ReportNotes told = notes(std::move(title), std::move(call), std::move(settings));
        write(file, [&] { return report_page(result, cloud, search, told); });
      },
      "file"_a, "result"_a, "cloud"_a, "search"_a, "title"_a, "call"_a, "settings"_a);
  module.def("check_report", [] { value_of(check_report()); });
}

}  // namespace swarmfit::python
