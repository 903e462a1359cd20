// What a depth image's numbers mean.
#pragma once

#include <swarmfit/cloud.hpp>

namespace swarmfit::cli {

struct DepthCamera {
  Intrinsics intrinsics;
  double scale = 0.001;  ///< [m a unit]
};

}  // namespace swarmfit::cli
