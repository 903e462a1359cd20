// Frame after frame: a line each, the next one loaded while this one is worked on.
#pragma once

#include <functional>
#include <string>

#include <swarmfit/perception.hpp>

#include "host/cli/frames.hpp"
#include "host/cli/options.hpp"

namespace swarmfit::cli {

struct SequenceJob {
  PerceiveOptions options;
  OutputFlags output;  ///< json: the lines, instead of stdout; out: a folder for each frame
  FrameSource next;
  bool ahead = true;  ///< the next frame is loaded meanwhile
  /// Told of each frame, in order.
  std::function<void(const FrameRef&, const PerceiveResult&, const Cloud&)> watch;
  /// Printed after the times.
  std::function<std::string()> more;
};

/// Gives the exit code. A frame that cannot be used is one line on stderr and no line of output; the others go on.
int run_sequence(const SequenceJob& job);

}  // namespace swarmfit::cli
