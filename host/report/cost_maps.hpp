// What the pixels of spaces of interest cost as object and as background, to look at.
#pragma once

#include <opencv2/core.hpp>

#include <swarmfit/perception.hpp>

namespace swarmfit::report {

/// Costs of Eqs. (6) and (7) as grey levels of the frame's size: 0 where no space of interest looks, else 1 for a cost of 0 to 255 for 1
/// and above. Where spaces of interest overlap, both are those of the one that the pixel suits best as object.
struct CostMaps {
  cv::Mat1b object;      ///< the colour's distance to the object's colours, and the pixel's to the group
  cv::Mat1b background;  ///< the colour's distance to the colours around the object
};

/// Empty without an image grid, colours or spaces of interest. `frame`: what `result` was seen in.
CostMaps cost_maps(const PerceiveResult& result, const Cloud& frame);

}  // namespace swarmfit::report
