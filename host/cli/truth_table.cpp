#include "host/cli/truth_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "host/cli/overlap.hpp"
#include "host/cli/report.hpp"

namespace swarmfit::cli {
namespace {

using Labels = std::span<const std::uint16_t>;

std::vector<bool> seen_pixels(const Cloud& cloud) {
  std::vector<bool> seen(cloud.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = std::isfinite(cloud.values64.empty() ? static_cast<double>(cloud.values32[3 * i + 2]) : cloud.values64[3 * i + 2]);
  }
  return seen;
}

/// Mean of the points with a true label.
Eigen::Vector3d centre_of(const Cloud& cloud, Labels truth, std::size_t k, const std::vector<bool>& seen) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] != k || !seen[i]) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t at = 3 * i + d;
      sum[static_cast<Eigen::Index>(d)] += cloud.values64.empty() ? static_cast<double>(cloud.values32[at]) : cloud.values64[at];
    }
    ++count;
  }
  return count ? Eigen::Vector3d(sum / static_cast<double>(count)) : sum;
}

std::string planes_table(const Scene& scene, const PerceiveResult& result, const std::vector<bool>& seen) {
  std::vector<std::vector<std::string>> rows = {{"surface", "normal", "found", "supports", "deg off", "mm off", "overlap"}};
  const auto matches = match_labels(scene.truth.plane_labels, scene.truth.planes.size(), result.fit.labels, result.fit.models.size(), seen);
  for (std::size_t k = 1; k <= scene.truth.planes.size(); ++k) {
    const Eigen::Vector4d& plane = scene.truth.planes[k - 1];
    const Eigen::Vector3d normal = plane.head<3>();
    std::vector<std::string> row = {std::to_string(k), fmt::format("({:6.3f}, {:6.3f}, {:6.3f})", normal.x(), normal.y(), normal.z())};
    const Match& match = matches[k];
    if (match.label == 0) {
      row.insert(row.end(), {"none", "", "", "", ""});
    } else {
      const Model& model = result.fit.models[match.label - 1];
      const double angle = std::acos(std::min(1.0, std::abs(model.normal().dot(normal)))) * 180 / std::numbers::pi;
      const double height = std::abs(model.normal().dot(centre_of(scene.cloud, scene.truth.plane_labels, k, seen)) + model.offset());
      row.insert(row.end(), {fmt::format("plane {}", match.label), model.supporting ? "yes" : "no", fmt::format("{:.2f}", angle),
                             fmt::format("{:.1f}", 1000 * height), fmt::format("{:.1f} %", 100 * match.iou)});
    }
    rows.push_back(std::move(row));
  }
  return table(rows);
}

std::string objects_table(const Scene& scene, const PerceiveResult& result, const std::vector<bool>& seen) {
  std::vector<std::vector<std::string>> rows = {{"object", "kind", "pixels", "found as", "outline's overlap", "name"}};
  const auto matches = match_labels(scene.truth.object_labels, scene.truth.objects, result.objects, result.sois.size(), seen);
  std::size_t found = 0;
  for (std::size_t k = 1; k <= scene.truth.objects; ++k) {
    const auto pixels = std::count(scene.truth.object_labels.begin(), scene.truth.object_labels.end(), k);
    const Match& match = matches[k];
    found += match.iou > 0.5;
    const bool has_kind = k <= scene.truth.object_names.size();
    std::vector<std::string> row = {std::to_string(k), has_kind ? scene.truth.object_names[k - 1] : "", std::to_string(pixels)};
    if (match.label == 0) {
      row.insert(row.end(), {"not found", "", ""});
    } else {
      const auto& names = result.sois[match.label - 1].recognised;
      row.insert(row.end(),
                 {fmt::format("SOI {}", match.label), fmt::format("{:.1f} %", 100 * match.iou), names.empty() ? "" : names.front().name});
    }
    rows.push_back(std::move(row));
  }
  return table(rows) + fmt::format("{} of {} objects overlap what was found by more than half\n", found, scene.truth.objects);
}

}  // namespace

std::string truth_table(const Scene& scene, const PerceiveResult& result) {
  const std::vector<bool> seen = seen_pixels(scene.cloud);
  return "\nthe scene's truth, what was found as it, and how far it is off\n" + planes_table(scene, result, seen) +
         objects_table(scene, result, seen);
}

}  // namespace swarmfit::cli
