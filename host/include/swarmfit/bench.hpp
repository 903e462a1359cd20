// Fitness throughput of each back end, against the limit that the same run measures.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/model.hpp>

namespace swarmfit {

class PointsView;

struct BenchOptions {
  std::vector<std::string> backends;                          ///< empty: every usable one (reference left out)
  std::vector<ModelType> models;                              ///< empty: every kind
  std::vector<std::size_t> points = {10000, 100000, 307200};  ///< each >= 1
  std::vector<std::size_t> particles = {64, 256};             ///< each in [2, 1000000]
  std::vector<bool> pruning = {false};
  int threads = 0;       ///< in [0, 4096]; 0: all
  double seconds = 0.3;  ///< least time a row is run for, > 0
  std::uint64_t seed = 1;

  /// Fails with invalid_option, naming the field, its value and its bound.
  SWARMFIT_API Expected<> validate() const;
};

struct BenchRow {
  std::string backend, device, model;
  std::size_t points = 0;  ///< finite ones
  std::size_t particles = 0;
  bool pruning = false;
  double evaluations_per_s = 0;   ///< points x particles a second; effective, with pruning
  double fraction_of_limit = 0;   ///< of fma_per_s over the model's own count of FMAs
  double max_relative_error = 0;  ///< against the reference
  double seconds = 0;             ///< median of one evaluation of the swarm
};

struct BenchReport {
  double fma_per_s = 0;  ///< scalar fused multiply-adds a second that the CPU reached in this run, all threads together
  int threads = 0;
  std::vector<BenchRow> rows;
};

/// Each row's costs are checked against the reference before it is timed; a mismatch is an error. `cloud` may be empty: uniform noise
/// around planes is made from the seed. `progress` is told of each row before it starts. Fails with invalid_option, backend_unavailable,
/// bad_input (a cloud of another dimension, costs that do not match) or out_of_memory.
SWARMFIT_API Expected<BenchReport> bench(const BenchOptions& options, const PointsView* cloud = nullptr,
                                         const std::function<void(const std::string&)>& progress = {});
/// The fields of a report under their names, rows as a list of objects.
SWARMFIT_API std::string to_json(const BenchReport& report);

}  // namespace swarmfit
