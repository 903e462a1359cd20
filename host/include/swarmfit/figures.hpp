// The figures of Zhou et al. 2010, drawn anew from real runs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

struct Figure {
  std::string name;   ///< of its file: "fig2-flight.svg" ...
  std::string shows;  ///< one line
  std::string svg;
};

/// Figures 2, 3 and 6 are one swarm of preset paper on one line among outliers, figure 7 is preset fast on several. Scenes and swarms
/// follow from the seed; the work is done on the CPU back end.
SWARMFIT_API Expected<std::vector<Figure>> paper_figures(std::uint64_t seed = 1);

}  // namespace swarmfit
