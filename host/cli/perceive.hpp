// The chain from a frame to files and a summary, as perceive and demo run it.
#pragma once

#include <functional>
#include <string>

#include <swarmfit/cloud.hpp>
#include <swarmfit/perception.hpp>
#include <swarmfit/report.hpp>

#include "host/cli/options.hpp"

namespace swarmfit::cli {

struct PerceiveJob {
  PerceiveOptions options;
  OutputFlags output;
  std::string input;  ///< what is read, for the progress line
  ReportNotes notes;  ///< of the report, where one is asked for
  std::function<Expected<Cloud>()> read;
  /// Printed after the summary, where there is one.
  std::function<std::string(const PerceiveResult&, const Cloud&)> more;
};

/// Gives the exit code.
int run_perceive(const PerceiveJob& job);

}  // namespace swarmfit::cli
