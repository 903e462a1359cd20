#include "host/cli/report.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace swarmfit::cli {

std::string count(std::size_t n, const char* thing) { return fmt::format("{} {}{}", n, thing, n == 1 ? "" : "s"); }

namespace {

/// Characters as they show on a terminal: the bytes that start one.
std::size_t shown(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

bool is_number(const std::string& cell) { return !cell.empty() && cell.find_first_not_of("0123456789+-.e% ") == std::string::npos; }

constexpr std::size_t kLine = 80;

/// Parted where a line may end: at spaces, but not inside of "( 0.1, 2.5)". Each part but the first starts with its spaces.
std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> parts(1);
  bool in_numbers = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(' && i + 1 < text.size()) in_numbers = std::string_view("0123456789- ").find(text[i + 1]) != std::string_view::npos;
    if (text[i] == ')') in_numbers = false;
    if (text[i] == ' ' && !in_numbers && i > 0 && text[i - 1] != ' ') parts.emplace_back();
    parts.back() += text[i];
  }
  return parts;
}

std::string without_indent(const std::string& word) {
  const std::size_t first = word.find_first_not_of(' ');
  return first == std::string::npos ? "" : word.substr(first);
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  if (shown(text) <= width) return {text};
  std::vector<std::string> lines(1);
  for (const std::string& word : words(text)) {
    if (!lines.back().empty() && shown(lines.back()) + shown(word) > width) {
      lines.push_back(without_indent(word));
    } else {
      lines.back() += word;
    }
  }
  return lines;
}

/// A sentence on lines of 80 columns, those after the first set in.
std::string sentence(const std::string& text) {
  if (shown(text) <= kLine) return text + "\n";
  const std::string indent = "  ";
  std::string out;
  for (const std::string& line : wrapped(text, kLine - indent.size())) out += (out.empty() ? "" : indent) + line + "\n";
  return out;
}

struct Column {
  std::size_t width = 0, least = 0;

  void hold(const std::string& cell) {
    width = std::max(width, shown(cell));
    for (const std::string& word : words(cell)) least = std::max(least, shown(without_indent(word)));
  }
};

/// Narrows the columns that can be, the one with most to spare first, until a line holds them.
void fit(std::vector<Column>& columns) {
  std::size_t total = 0;
  for (const Column& column : columns) total += column.width + 2;
  while (total > kLine) {
    const auto spare = [](const Column& column) { return column.width - std::min(column.least, column.width); };
    const auto widest =
        std::max_element(columns.begin(), columns.end(), [&](const Column& a, const Column& b) { return spare(a) < spare(b); });
    const std::size_t cut = std::min(spare(*widest), total - kLine);
    if (cut == 0) return;
    widest->width -= cut;
    total -= cut;
  }
}

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
    case ModelType::own: break;  // not from the command
  }
  return {};
}

std::string models_table(const FitResult& result) {
  // All of one kind, so it stands once.
  std::vector<std::vector<std::string>> rows = {{"", std::string(name(result.models.front().type)), "inliers", "rms", ""}};
  for (std::size_t k = 0; k < result.models.size(); ++k) {
    const Model& m = result.models[k];
    rows.push_back(
        {std::to_string(k + 1), parameters(m), std::to_string(m.inliers), fmt::format("{:.3g}", m.rms), m.supporting ? "*" : ""});
  }
  return table(rows);
}

std::string head(const FitResult& result, const Cloud& input) {
  std::string out = fmt::format("{} points", input.size());
  if (input.organised()) out += fmt::format(" ({} x {})", input.width, input.height);
  out += fmt::format(", {} finite\n", result.finite_points);
  return out + sentence(fmt::format("{} on {} ({})", result.backend.name, result.backend.device, result.backend.reason));
}

std::string sois_table(const PerceiveResult& result) {
  std::vector<std::vector<std::string>> rows = {{"", "plane", "points", "centre", "radius", "x,y,w,h", "name"}};
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
  std::vector<Column> columns;
  for (const auto& row : rows) {
    if (columns.size() < row.size()) columns.resize(row.size());
    for (std::size_t c = 0; c < row.size(); ++c) columns[c].hold(row[c]);
  }
  fit(columns);
  std::string out;
  for (const auto& row : rows) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (std::size_t c = 0; c < row.size(); ++c) {
      cells.push_back(wrapped(row[c], columns[c].width));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t k = 0; k < height; ++k) {
      std::string line = " ";
      for (std::size_t c = 0; c < row.size(); ++c) {
        const std::string cell = k < cells[c].size() ? cells[c][k] : "";
        const std::string pad(columns[c].width - std::min(columns[c].width, shown(cell)), ' ');
        line += " " + (is_number(cell) ? pad + cell : cell + pad) + " ";
      }
      line.erase(line.find_last_not_of(' ') + 1);
      out += line + "\n";
    }
  }
  return out;
}

std::string summary(const FitResult& result, const Cloud& input, double load_ms) {
  std::string out = head(result, input) + count(result.models.size(), "model") + fmt::format(", threshold {:.4g}\n", result.threshold);
  if (!result.models.empty()) out += models_table(result);
  out += sentence(fmt::format("{:.1f} ms (loading {:.1f} ms), {} evaluations, {:.0f} % of points touched", result.total_ms, load_ms,
                              result.evaluations, 100 * result.points_touched));
  return out + sentence("stopped: " + result.stop_reason);
}

std::string summary(const PerceiveResult& result, const Cloud& input) {
  const auto& models = result.fit.models;
  const auto supporting = std::count_if(models.begin(), models.end(), [](const Model& m) { return m.supporting; });
  std::string out = head(result.fit, input);
  out += sentence(fmt::format("{}, {} supporting (*); up is ({:.3f}, {:.3f}, {:.3f}) by {}", count(models.size(), "plane"), supporting,
                              result.up.x(), result.up.y(), result.up.z(), result.vertical_source));
  if (!models.empty()) out += models_table(result.fit);
  out += fmt::format("{} of interest\n", count(result.sois.size(), "space"));
  if (!result.sois.empty()) out += sois_table(result);
  const auto& t = result.timing_ms;
  out += sentence(fmt::format("{:.1f} ms: fit {:.1f}, pop-out {:.1f}, segment {:.1f}, recognise {:.1f} (loading {:.1f} ms)", t.total, t.fit,
                              t.popout, t.segment, t.recognise, t.load));
  return out + sentence("stopped: " + result.fit.stop_reason);
}

std::vector<std::string> explanation(const FitResult& result, const Cloud& input) {
  std::vector<std::string> lines;
  const auto say = [&](const char* what, std::string text) { lines.push_back(fmt::format("{:<11}{}", what, text)); };
  say("back end", fmt::format("{} on {}; {}", result.backend.name, result.backend.device, result.backend.reason));
  say("points", fmt::format("{}, {} of them finite", input.size(), result.finite_points));
  say("threshold", fmt::format("{:.6g}", result.threshold));
  say("seed", std::to_string(result.seed));
  for (std::size_t k = 0; k < result.models.size(); ++k) {
    const Model& m = result.models[k];
    say(fmt::format("model {}", k + 1).c_str(),
        fmt::format("at {:.1f} ms after {} and {}, {:.0f} % of points touched", m.found_at_ms, count(m.iterations, "round"),
                    count(m.evaluations, "evaluation"), 100 * m.points_touched));
  }
  say("in all", fmt::format("{} and {}, {:.0f} % of points touched", count(result.iterations, "round"),
                            count(result.evaluations, "evaluation"), 100 * result.points_touched));
  say("stopped", result.stop_reason);
  return lines;
}

std::string stages(const std::vector<std::pair<const char*, double>>& times_ms) {
  std::string line = "times      ";
  for (std::size_t k = 0; k < times_ms.size(); ++k)
    line += fmt::format("{}{} {:.1f}", k ? ", " : "", times_ms[k].first, times_ms[k].second);
  return line + " [ms]";
}

}  // namespace swarmfit::cli
