#include "host/report/search_json.hpp"

#include <algorithm>
#include <cstring>

namespace swarmfit::report {
namespace {

using nlohmann::json;

/// The same model with the origin moved to `centre`.
Eigen::VectorXd about(ModelType type, Eigen::VectorXd p, const Eigen::Vector3d& centre) {
  switch (type) {
    case ModelType::line2d: p[2] += p.head<2>().dot(centre.head<2>()); break;
    case ModelType::plane: p[3] += p.head<3>().dot(centre); break;
    case ModelType::circle2d: p.head<2>() -= centre.head<2>(); break;
    case ModelType::sphere:
    case ModelType::cylinder: p.head<3>() -= centre; break;
    case ModelType::homography:
    case ModelType::fundamental:
    case ModelType::own: break;  // who knows how to move it
  }
  return p;
}

void append(Bytes& bytes, double value) {
  const auto narrow = static_cast<float>(value);
  std::uint8_t raw[sizeof narrow];
  std::memcpy(raw, &narrow, sizeof narrow);
  bytes.insert(bytes.end(), raw, raw + sizeof narrow);
}

/// The shares of what could be saved, in thousandths: short, and all that a colour needs.
json shares(const SearchRecord::Step& step) {
  json all = json::array();
  for (const double f : step.fitness) {
    const double share = step.nothing_explained > 0 ? (step.nothing_explained - f) / step.nothing_explained : 0;
    all.push_back(static_cast<int>(1000 * std::clamp(share, 0.0, 1.0)));
  }
  return all;
}

json list(const Eigen::VectorXd& values) { return std::vector<double>(values.data(), values.data() + values.size()); }

/// 1-based place among the result's models, 0 where it did not stay: the moment it was found is its name.
std::size_t place(const Model& found, const std::vector<Model>& models) {
  const auto same = std::find_if(models.begin(), models.end(), [&](const Model& m) { return m.found_at_ms == found.found_at_ms; });
  return same == models.end() ? 0 : static_cast<std::size_t>(same - models.begin()) + 1;
}

}  // namespace

Replay replay(const SearchRecord& search, const std::vector<Model>& models, const Eigen::Vector3d& centre) {
  Replay out;
  json steps = json::array(), found = json::array();
  for (const SearchRecord::Step& step : search.steps()) {
    const bool pairs = dimension(step.type) == 4;
    steps.push_back({{"type", name(step.type)},
                     {"swarm", step.swarm},
                     {"step", step.step},
                     {"best", pairs ? json::array() : list(about(step.type, step.best, centre))},
                     {"fitness", step.best_fitness},
                     {"nothing", step.nothing_explained},
                     {"shares", pairs ? json::array() : shares(step)}});
    for (Eigen::Index j = 0; !pairs && j < step.positions.cols(); ++j) {
      const Eigen::VectorXd theta = about(step.type, step.positions.col(j), centre);
      for (const double value : theta) append(out.particles, value);
    }
  }
  for (const SearchRecord::Found& f : search.found()) {
    found.push_back({{"after", f.after},
                     {"type", name(f.model.type)},
                     {"parameters", list(about(f.model.type, f.model.parameters, centre))},
                     {"inliers", f.model.inliers},
                     {"at_ms", f.model.found_at_ms},
                     {"model", place(f.model, models)}});
  }
  out.steps = {{"particles", search.particles()}, {"every", search.every()}, {"steps", steps}, {"found", found}};
  return out;
}

}  // namespace swarmfit::report
