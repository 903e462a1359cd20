// Middlebury's calib.txt.
#pragma once

#include <filesystem>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>

namespace swarmfit::io {

struct StereoCalibration {
  Intrinsics left;            ///< cam0
  double doffs = 0;           ///< cx of the right camera less cx of the left [px]
  double baseline = 0;        ///< [m]; the file has mm
  int disparities = 0;        ///< ndisp: every disparity is below it [px]
  int width = 0, height = 0;  ///< 0 where the file does not say
};

/// `key=value` lines; blanks may stand before the key and within the value. Fails with bad_input, naming the field.
Expected<StereoCalibration> read_calibration(const std::filesystem::path& file);

}  // namespace swarmfit::io
