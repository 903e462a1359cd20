// What a run of the contenders has to say, for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "bench/judge.hpp"

namespace swarmfit::peers {

struct Quartiles {
  double low = 0, median = 0, high = 0;
};
Quartiles quartiles(std::vector<double> values);

/// One contender on one scene, a value a run. `cpu_ms` is the processor time of all its threads: what is left to compare by where other
/// work disturbs the clock.
struct Entry {
  std::string name, how;
  bool organised = false;
  std::string failure;  ///< why it could not do this scene; then the rest is empty
  std::vector<double> ms, cpu_ms, normals_ms, planes, counted, inliers, evaluations;
  std::vector<double> lacked;  ///< planes of ours, of the same run, that it has not
  std::vector<double> beyond;  ///< its planes that ours, of the same run, has not
  std::vector<Judged> first;   ///< what was said of the first run's planes
};

struct SceneReport {
  std::string name;
  std::size_t points = 0, finite = 0;
  Task task;
  std::vector<Entry> entries;
  std::vector<Surface> surfaces;
};

struct Missing {
  std::string name, reason;
};

struct Report {
  int threads = 0, runs = 0;
  double load_before = 0, load_after = 0;  ///< the machine's load average over the last minute
  std::vector<Missing> missing;
  std::vector<SceneReport> scenes;
};

std::string table(const SceneReport& scene);
std::string table(const std::vector<Missing>& missing);
std::string to_json(const Report& report);

}  // namespace swarmfit::peers
