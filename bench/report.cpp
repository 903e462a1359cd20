#include "bench/report.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace swarmfit::peers {
namespace {

constexpr double kOftenEnough = 0.9;  // of the runs: below that a plane is told of as one that ours may lack

double median(const std::vector<double>& values) { return quartiles(values).median; }

std::string one_digit(const std::vector<double>& values) { return values.empty() ? "" : fmt::format("{:.1f}", median(values)); }

double mean_of(const std::vector<double>& values) {
  return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::string mean(const std::vector<double>& values) { return values.empty() ? "" : fmt::format("{:.1f}", mean_of(values)); }

std::string surface_line(const SceneReport& scene, const Surface& surface) {
  const auto& n = surface.seen.plane.normal;
  std::string line = fmt::format("  ({:6.3f} {:6.3f} {:6.3f}) {:7.3f}  {:7} points, level {:3.0f} %:", n[0], n[1], n[2],
                                 surface.seen.plane.offset, surface.seen.held, 100 * surface.seen.level);
  std::string finders;
  for (const Entry& entry : scene.entries) {
    const auto found = surface.runs.find(entry.name);
    if (entry.ms.empty() || found == surface.runs.end() || found->second == 0) continue;
    finders += fmt::format("{}{} {}/{}", finders.empty() ? "" : ", ", entry.name, found->second, entry.ms.size());
  }
  return line + "\n      " + finders + "\n";
}

nlohmann::ordered_json json_of(const std::vector<double>& values) {
  const Quartiles q = quartiles(values);
  return {{"mean", mean_of(values)}, {"median", q.median}, {"low_quartile", q.low}, {"high_quartile", q.high}};
}

}  // namespace

Quartiles quartiles(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], place - static_cast<double>(below));
  };
  return {at(0.25), at(0.5), at(0.75)};
}

std::string table(const SceneReport& scene) {
  std::string out = fmt::format("{}: {} points, {} finite, threshold {:g}, a plane holds {} at least\n", scene.name, scene.points,
                                scene.finite, scene.task.threshold, scene.task.min_inliers);
  out += fmt::format("{:22} {:>9} {:>17} {:>7} {:>4} {:>5} {:>5} {:>8} {:>7} {:>7}\n", "", "ms median", "quartiles", "CPU ms", "runs",
                     "found", "count", "inliers", "beyond", "lacking");
  for (const Entry& entry : scene.entries) {
    if (entry.ms.empty()) {
      out += fmt::format("{:22} {}\n", entry.name, entry.failure.empty() ? "not run" : entry.failure);
      continue;
    }
    const Quartiles ms = quartiles(entry.ms);
    out += fmt::format("{:22} {:9.1f} {:>17} {:7.1f} {:4} {:>5} {:>5} {:7.1f}% {:>7} {:>7}\n", entry.name, ms.median,
                       fmt::format("{:.1f} .. {:.1f}", ms.low, ms.high), median(entry.cpu_ms), entry.ms.size(), one_digit(entry.planes),
                       one_digit(entry.counted), 100 * median(entry.inliers) / static_cast<double>(scene.finite), mean(entry.beyond),
                       mean(entry.lacked));
    if (!entry.failure.empty()) out += fmt::format("{:22} then failed: {}\n", "", entry.failure);
  }
  std::string lacking;
  for (const Surface& surface : scene.surfaces) {
    const auto& ours = scene.entries.front();
    const auto found = surface.runs.find(ours.name);
    const double runs = found == surface.runs.end() ? 0 : found->second;
    if (runs < kOftenEnough * static_cast<double>(ours.ms.size())) lacking += surface_line(scene, surface);
  }
  if (!lacking.empty()) {
    out += fmt::format("planes that count and that {} has in fewer than {:.0f} % of its runs: normal, offset, who has them\n",
                       scene.entries.front().name, 100 * kOftenEnough);
    out += lacking;
  }
  return out;
}

std::string table(const std::vector<Missing>& missing) {
  std::string out;
  for (const Missing& m : missing) out += fmt::format("{:22} not here: {}\n", m.name, m.reason);
  return out;
}

std::string to_json(const Report& report) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["schema"] = 1;
  json["threads"] = report.threads;
  json["runs"] = report.runs;
  json["load"] = {{"before", report.load_before}, {"after", report.load_after}};
  json["match"] = {{"thresholds", kMatchThresholds}, {"share", kMatchShare}};
  json["counts"] = {{"least_held", kLeastHeld}, {"least_level", kLeastLevel}, {"level_cosine", kLevelCosine}};
  json["missing"] = Json::array();
  for (const Missing& m : report.missing) json["missing"].push_back({{"name", m.name}, {"reason", m.reason}});
  json["scenes"] = Json::array();
  for (const SceneReport& scene : report.scenes) {
    Json out = {{"name", scene.name},
                {"points", scene.points},
                {"finite", scene.finite},
                {"threshold", scene.task.threshold},
                {"min_inliers", scene.task.min_inliers}};
    out["contenders"] = Json::array();
    for (const Entry& entry : scene.entries) {
      Json row = {{"name", entry.name}, {"how", entry.how}, {"organised", entry.organised}, {"runs", entry.ms.size()}};
      if (!entry.failure.empty()) row["failure"] = entry.failure;
      if (!entry.ms.empty()) {
        row["ms"] = json_of(entry.ms);
        row["cpu_ms"] = json_of(entry.cpu_ms);
        row["normals_ms"] = json_of(entry.normals_ms);
        row["planes"] = json_of(entry.planes);
        row["planes_that_count"] = json_of(entry.counted);
        row["inliers"] = json_of(entry.inliers);
        row["evaluations"] = json_of(entry.evaluations);
        row["beyond_ours"] = json_of(entry.beyond);
        row["lacking_of_ours"] = json_of(entry.lacked);
        row["each_ms"] = entry.ms;
        row["first_run"] = Json::array();
        for (const Judged& plane : entry.first) {
          row["first_run"].push_back({{"normal", plane.plane.normal},
                                      {"offset", plane.plane.offset},
                                      {"claimed", plane.claimed},
                                      {"held", plane.held},
                                      {"level", plane.level},
                                      {"counts", plane.counts}});
        }
      }
      out["contenders"].push_back(std::move(row));
    }
    out["surfaces"] = Json::array();
    for (const Surface& surface : scene.surfaces) {
      out["surfaces"].push_back({{"normal", surface.seen.plane.normal},
                                 {"offset", surface.seen.plane.offset},
                                 {"points", surface.seen.held},
                                 {"level", surface.seen.level},
                                 {"first_found_by", surface.by},
                                 {"runs", surface.runs}});
    }
    json["scenes"].push_back(std::move(out));
  }
  return json.dump(1) + "\n";
}

}  // namespace swarmfit::peers
