// The figures of Zhou et al. 2010, drawn anew from real runs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit {

struct Figure {
  std::string name;   ///< of its file: "fig2-flight.svg", "fig4-planes.jpg" ...
  std::string shows;  ///< one line
  std::string bytes;  ///< the whole file
};

/// Figures 2, 3 and 6 are one swarm of preset paper on one line among outliers, figure 7 is preset fast on several: SVG. Scenes and swarms
/// follow from the seed; the work is done on the CPU back end. Fails with out_of_memory.
SWARMFIT_API Expected<std::vector<Figure>> paper_figures(std::uint64_t seed = 1);

/// Figures 4 and 5, and what segmentation with fixation sees, of one organised coloured frame: JPEG. Planes and what sticks out of them are
/// found as `options` has it; of the outlines every kind is shown. Fails with bad_input and as Perceiver does.
SWARMFIT_API Expected<std::vector<Figure>> perception_figures(const Cloud& frame, const PerceiveOptions& options = {});

}  // namespace swarmfit
