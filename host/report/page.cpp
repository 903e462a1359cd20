#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>
#include <swarmfit/version.hpp>

#include "host/common/thrown.hpp"
#include "host/io/ground_image.hpp"
#include "host/io/jpeg.hpp"
#include "host/io/palette.hpp"
#include "host/io/png.hpp"
#include "host/report/cost_maps.hpp"
#include "host/report/encode.hpp"
#include "host/report/search_json.hpp"
#ifdef SWARMFIT_REPORT_PAGE
#include "embedded/report_page.h"
#endif

namespace swarmfit {
namespace {

using nlohmann::json;
using report::Bytes;

constexpr std::size_t kMostPoints = 300'000;
constexpr int kWidestImage = 1280;  // [px]
constexpr int kJpegQuality = 88;

#ifdef SWARMFIT_REPORT_PAGE
constexpr std::string_view kMarker = "<!--data-->";

std::string empty_page() {
  std::string page;
  for (const std::string_view part : report_page_parts) page += part;
  return page;
}
#endif

/// `<` cannot end a script then, whatever a file is called.
std::string text_of(const json& value) {
  const std::string plain = value.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string safe;
  safe.reserve(plain.size());
  for (const char c : plain) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

/// What goes between the page's scripts: one element a part.
class Parts {
 public:
  void add(const char* id, const json& value) {
    out_ += fmt::format("<script type=\"application/json\" id=\"{}\">{}</script>\n", id, text_of(value));
  }
  void add(const char* id, const Bytes& bytes) {
    out_ += fmt::format("<script type=\"text/plain\" id=\"{}\">{}</script>\n", id, report::base64(bytes));
  }
  std::string take() && { return std::move(out_); }

 private:
  std::string out_;
};

json colours() {
  json all = json::array();
  constexpr std::size_t kDistinct = 10;
  for (std::size_t k = 1; k <= kDistinct; ++k) all.push_back(io::plane_colour(k));
  return all;
}

/// Labels of an image seen through a coarser grid.
std::vector<std::uint16_t> coarser(const std::vector<std::uint16_t>& labels, const Cloud& input, int every) {
  std::vector<std::uint16_t> some;
  for (int v = 0; v < input.height; v += every) {
    for (int u = 0; u < input.width; u += every) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(input.width) + static_cast<std::size_t>(u);
      some.push_back(i < labels.size() ? labels[i] : std::uint16_t{0});
    }
  }
  return some;
}

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

/// One in `every` pixels and rows, without loss.
Bytes png(const cv::Mat1b& levels, int every, cv::Size size) {
  cv::Mat shown = levels;
  if (every > 1) cv::resize(levels, shown, size, 0, 0, cv::INTER_NEAREST);
  return bytes_of(io::encode_png(shown, io::PngEffort::small));
}

json add_image(Parts& parts, const Cloud& input, const std::vector<std::uint16_t>& planes, const PerceiveResult* perceived) {
  const int every = (input.width + kWidestImage - 1) / kWidestImage;
  const int width = (input.width + every - 1) / every, height = (input.height + every - 1) / every;
  cv::Mat image = io::ground_image(input);
  if (every > 1) cv::resize(image, image, {width, height}, 0, 0, cv::INTER_AREA);
  parts.add("image-jpeg", bytes_of(io::encode_jpeg(image, kJpegQuality)));
  parts.add("image-planes", report::runs(coarser(planes, input, every)));
  if (perceived != nullptr) {
    parts.add("image-popout", report::runs(coarser(perceived->popout, input, every)));
    parts.add("image-objects", report::runs(coarser(perceived->objects, input, every)));
    if (const report::CostMaps costs = report::cost_maps(*perceived, input); !costs.object.empty()) {
      parts.add("image-cost-object", png(costs.object, every, {width, height}));
      parts.add("image-cost-background", png(costs.background, every, {width, height}));
    }
  }
  return {{"width", width}, {"height", height}, {"every", every}, {"coloured", input.coloured()}};
}

json add_cloud(Parts& parts, const Cloud& input, const report::Quantised& points, const report::Shown& shown,
               const std::vector<std::uint16_t>& planes, const PerceiveResult* perceived) {
  parts.add("points", points.bytes);
  parts.add("points-index", report::differences(shown.index));
  parts.add("points-planes", report::runs(report::gather(planes, shown.index)));
  if (perceived != nullptr) {
    parts.add("points-popout", report::runs(report::gather(perceived->popout, shown.index)));
    if (!perceived->objects.empty()) parts.add("points-objects", report::runs(report::gather(perceived->objects, shown.index)));
  }
  if (input.coloured()) {
    Bytes rgb;
    rgb.reserve(3 * shown.index.size());
    for (const std::uint32_t i : shown.index) rgb.insert(rgb.end(), input.rgb.begin() + 3L * i, input.rgb.begin() + 3L * i + 3);
    parts.add("points-rgb", rgb);
  }
  return {{"dimension", input.dimension}, {"low", points.low},    {"high", points.high},   {"shown", shown.index.size()},
          {"every", shown.every},         {"width", input.width}, {"height", input.height}};
}

json settings(const ReportNotes& notes) {
  json all = json::array();
  for (const auto& s : notes.settings) all.push_back({{"name", s.name}, {"value", s.value}, {"given", s.given}});
  return all;
}

/// `result`: result.json's text.
Expected<std::string> make_page(const std::string& result, const FitResult& fit, const PerceiveResult* perceived, const Cloud& input,
                                const SearchRecord& search, const ReportNotes& notes) try {
  if (auto ok = check_report(); !ok) return tl::unexpected(ok.error());
  const report::Shown shown = report::choose_points(input, kMostPoints);
  const report::Quantised points = report::quantise(input, shown.index);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int d = 0; d < std::min(3, input.dimension); ++d) {
    const auto k = static_cast<std::size_t>(d);
    centre[d] = points.low[k] / 2 + points.high[k] / 2;
  }
  Parts parts;
  json about = {{"kind", perceived != nullptr ? "perceive" : "fit"},
                {"title", notes.title},
                {"command", notes.command},
                {"version", fmt::format("{}.{}.{}", SWARMFIT_VERSION_MAJOR, SWARMFIT_VERSION_MINOR, SWARMFIT_VERSION_PATCH)},
                {"settings", settings(notes)},
                {"colours", colours()},
                {"sticking_out", io::kStickingOut},
                {"iterations", fit.iterations},
                {"evaluations", fit.evaluations},
                {"points_touched", fit.points_touched}};
  if (perceived != nullptr) {
    about["up"] = {perceived->up.x(), perceived->up.y(), perceived->up.z()};
    about["vertical_source"] = perceived->vertical_source;
  }
  about["cloud"] = add_cloud(parts, input, points, shown, fit.labels, perceived);
  about["centre"] = {centre.x(), centre.y(), centre.z()};
  if (input.organised() && input.dimension == 3) about["image"] = add_image(parts, input, fit.labels, perceived);
  const report::Replay replay = report::replay(search, fit.models, centre);
  parts.add("search", replay.steps);
  parts.add("search-particles", replay.particles);
  parts.add("result", json::parse(result));
  parts.add("about", about);
#ifdef SWARMFIT_REPORT_PAGE
  std::string page = empty_page();
  page.replace(page.find(kMarker), kMarker.size(), std::move(parts).take());
  return page;
#else
  return std::move(parts).take();  // never: check_report() has failed
#endif
} catch (...) {
  return common::error_of_thrown(Error::Kind::cannot_write, [&] { return fmt::format("no memory for a page of {} points", input.size()); });
}

}  // namespace

Expected<> check_report() {
#ifdef SWARMFIT_REPORT_PAGE
  return {};
#else
  return fail(Error::Kind::cannot_write, "report: this build cannot write one: " SWARMFIT_REPORT_MISSING
                                         " when it was configured; docs/report.md tells how to have it");
#endif
}

Expected<std::string> report_page(const FitResult& result, const Cloud& input, double load_ms, const SearchRecord& search,
                                  const ReportNotes& notes) {
  return make_page(to_json(result, input, load_ms), result, nullptr, input, search, notes);
}

Expected<std::string> report_page(const PerceiveResult& result, const Cloud& input, const SearchRecord& search, const ReportNotes& notes) {
  return make_page(to_json(result, input), result.fit, &result, input, search, notes);
}

}  // namespace swarmfit
