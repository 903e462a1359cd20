// A cloud in memory, and the readers that make one.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit {

/// Pinhole camera [px].
struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// Points in input order, perhaps on an image grid, perhaps with colour. One of `values32`, `values64` is filled, as precise as the source.
struct Cloud {
  int dimension = 3;            ///< columns a point
  std::vector<float> values32;  ///< dimension x size, row after row
  std::vector<double> values64;
  std::vector<std::uint8_t> rgb;         ///< 3 a point (red, green, blue), or empty
  int width = 0, height = 0;             ///< height > 1: organised, point (u, v) is at v * width + u; else height is 1
  std::optional<Intrinsics> intrinsics;  ///< of the camera behind an organised cloud, where known
  bool passive_stereo = false;           ///< the depth was matched between images: little worth where they have no texture

  std::size_t size() const noexcept { return (values64.empty() ? values32.size() : values64.size()) / static_cast<std::size_t>(dimension); }
  bool organised() const noexcept { return height > 1; }
  bool coloured() const noexcept { return !rgb.empty(); }
  PointsView points() const noexcept {
    return values64.empty() ? PointsView(std::span<const float>(values32), dimension)
                            : PointsView(std::span<const double>(values64), dimension);
  }
  /// Do its lists and its size agree? Fails with bad_input, naming the field, its value and its bound.
  SWARMFIT_API Expected<> validate() const;
};

/// .pcd, .ply, .xyz, or .csv (`x,y`, `x,y,z` or `x1,y1,x2,y2`; header optional; a column named `label` is ignored), by the file's
/// extension. Fails with bad_input.
SWARMFIT_API Expected<Cloud> read_cloud(const std::filesystem::path& file);

/// A 16-bit depth PNG to an organised cloud: z = value * depth_scale [m], 0 is a hole (NaN). Fails with invalid_option (intrinsics, a depth
/// scale that is not > 0) or bad_input, as the two below do.
SWARMFIT_API Expected<Cloud> read_depth(const std::filesystem::path& depth, const Intrinsics& intrinsics, double depth_scale);

/// A colour image registered to a depth image of the same size.
SWARMFIT_API Expected<Cloud> read_rgbd(const std::filesystem::path& color, const std::filesystem::path& depth, const Intrinsics& intrinsics,
                                       double depth_scale);

/// A rectified pair and Middlebury's calib.txt: dense stereo (semi-global matching), Z = baseline f / (d + doffs), in metres
/// (calib.txt gives the baseline in mm). The cloud lies on the left image's grid and takes its colours.
SWARMFIT_API Expected<Cloud> read_stereo(const std::filesystem::path& left, const std::filesystem::path& right,
                                         const std::filesystem::path& calib);

}  // namespace swarmfit
