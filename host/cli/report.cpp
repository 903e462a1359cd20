#include "host/cli/report.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace swarmfit::cli {
namespace {

/// Characters as they show on a terminal: the bytes that start one.
std::size_t shown(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

bool is_number(const std::string& cell) { return !cell.empty() && cell.find_first_not_of("0123456789+-.e% ") == std::string::npos; }

std::string parameters(const Model& m) {
  const Eigen::VectorXd& p = m.parameters;
  switch (m.type) {
    case ModelType::line2d: return fmt::format("normal ({:7.4f}, {:7.4f})  offset {:.6g}", p[0], p[1], p[2]);
    case ModelType::plane: return fmt::format("normal ({:7.4f}, {:7.4f}, {:7.4f})  offset {:.6g}", p[0], p[1], p[2], p[3]);
    case ModelType::circle2d: return fmt::format("centre ({:.6g}, {:.6g})  radius {:.6g}", p[0], p[1], p[2]);
    case ModelType::sphere: return fmt::format("centre ({:.6g}, {:.6g}, {:.6g})  radius {:.6g}", p[0], p[1], p[2], p[3]);
    case ModelType::cylinder:
      return fmt::format("through ({:.4g}, {:.4g}, {:.4g})  axis ({:.3f}, {:.3f}, {:.3f})  radius {:.4g}", p[0], p[1], p[2], p[3], p[4],
                         p[5], p[6]);
    case ModelType::homography:
    case ModelType::fundamental:
      return fmt::format("[{:.3g} {:.3g} {:.3g}; {:.3g} {:.3g} {:.3g}; {:.3g} {:.3g} {:.3g}]", p[0], p[1], p[2], p[3], p[4], p[5], p[6],
                         p[7], p[8]);
  }
  return {};
}

std::string models_table(const FitResult& result) {
  std::vector<std::vector<std::string>> rows = {{"", "model", "parameters", "inliers", "rms", ""}};
  for (std::size_t k = 0; k < result.models.size(); ++k) {
    const Model& m = result.models[k];
    rows.push_back({std::to_string(k + 1), std::string(name(m.type)), parameters(m), std::to_string(m.inliers),
                    fmt::format("{:.3g}", m.rms), m.supporting ? "supports" : ""});
  }
  return table(rows);
}

std::string count(std::size_t n, const char* thing) { return fmt::format("{} {}{}", n, thing, n == 1 ? "" : "s"); }

std::string head(const FitResult& result, const Cloud& input) {
  std::string out = fmt::format("{} points", input.size());
  if (input.organised()) out += fmt::format(" ({} x {})", input.width, input.height);
  out +=
      fmt::format(", {} finite; {} on {} ({})\n", result.finite_points, result.backend.name, result.backend.device, result.backend.reason);
  return out;
}

std::string sois_table(const PerceiveResult& result) {
  std::vector<std::vector<std::string>> rows = {{"", "on plane", "points", "centre", "radius", "x,y,w,h in the image", "name"}};
  for (std::size_t k = 0; k < result.sois.size(); ++k) {
    const SpaceOfInterest& s = result.sois[k];
    const bool on_grid = s.bbox[2] > 0;
    rows.push_back({std::to_string(k + 1), std::to_string(s.plane), std::to_string(s.points),
                    fmt::format("({:6.3f}, {:6.3f}, {:6.3f})", s.centre.x(), s.centre.y(), s.centre.z()), fmt::format("{:.3f}", s.radius),
                    on_grid ? fmt::format("{},{},{},{}", s.bbox[0], s.bbox[1], s.bbox[2], s.bbox[3]) : "",
                    s.recognised.empty() ? "" : fmt::format("{} ({:.2f})", s.recognised.front().name, s.recognised.front().score)});
  }
  return table(rows);
}

}  // namespace

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], shown(row[c]));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string pad(widths[c] - shown(row[c]), ' ');
      line += " " + (is_number(row[c]) ? pad + row[c] : row[c] + pad) + " ";
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

std::string summary(const FitResult& result, const Cloud& input, double load_ms) {
  std::string out = head(result, input) + count(result.models.size(), "model") + fmt::format(", threshold {:.4g}\n", result.threshold);
  if (!result.models.empty()) out += models_table(result);
  out += fmt::format("{:.1f} ms (loading {:.1f} ms), {} evaluations, {:.0f} % of points touched; stopped: {}\n", result.total_ms, load_ms,
                     result.evaluations, 100 * result.points_touched, result.stop_reason);
  return out;
}

std::string summary(const PerceiveResult& result, const Cloud& input) {
  const auto& models = result.fit.models;
  const auto supporting = std::count_if(models.begin(), models.end(), [](const Model& m) { return m.supporting; });
  std::string out = head(result.fit, input);
  out += fmt::format("{}, {} supporting; up is ({:.3f}, {:.3f}, {:.3f}) by {}\n", count(models.size(), "plane"), supporting, result.up.x(),
                     result.up.y(), result.up.z(), result.vertical_source);
  if (!models.empty()) out += models_table(result.fit);
  out += fmt::format("{} of interest\n", count(result.sois.size(), "space"));
  if (!result.sois.empty()) out += sois_table(result);
  const auto& t = result.timing_ms;
  out += fmt::format("{:.1f} ms: fit {:.1f}, pop-out {:.1f}, segment {:.1f}, recognise {:.1f} (loading {:.1f} ms); stopped: {}\n", t.total,
                     t.fit, t.popout, t.segment, t.recognise, t.load, result.fit.stop_reason);
  return out;
}

}  // namespace swarmfit::cli
