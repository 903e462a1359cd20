#include <nlohmann/json.hpp>

#include <swarmfit/bench.hpp>

namespace swarmfit {

std::string to_json(const BenchReport& report) {
  nlohmann::ordered_json json;
  json["schema"] = 1;
  json["limit"] = {{"fma_per_s", report.fma_per_s}, {"threads", report.threads}};
  json["results"] = nlohmann::ordered_json::array();
  for (const BenchRow& row : report.rows) {
    nlohmann::ordered_json out;
    out["backend"] = row.backend;
    out["device"] = row.device;
    out["model"] = row.model;
    out["points"] = row.points;
    out["particles"] = row.particles;
    out["pruning"] = row.pruning;
    out["evaluations_per_s"] = row.evaluations_per_s;
    out["fraction_of_limit"] = row.fraction_of_limit;
    out["max_relative_error"] = row.max_relative_error;
    out["seconds"] = row.seconds;
    json["results"].push_back(std::move(out));
  }
  return json.dump(2);
}

}  // namespace swarmfit
