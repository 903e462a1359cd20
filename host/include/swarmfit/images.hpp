// Depth and colour images in memory to an organised cloud.
#pragma once

#include <cstddef>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>

namespace swarmfit {

/// A depth image in the caller's memory. Owns nothing: the memory must outlive the call it is given to.
struct DepthView {
  enum class Scalar { uint16, float32 };
  const void* data = nullptr;
  Scalar scalar = Scalar::uint16;
  int width = 0, height = 0;  ///< [px], >= 1
  std::size_t row_step = 0;   ///< bytes from a row to the next; 0: tight
};

/// An 8-bit colour image in the caller's memory, 3 bytes a pixel; no data: no colour.
struct ColourView {
  enum class Order { rgb, bgr };
  const void* data = nullptr;
  Order order = Order::rgb;
  int width = 0, height = 0;  ///< [px], as the depth image
  std::size_t row_step = 0;   ///< bytes from a row to the next; 0: tight
};

/// What read_depth and read_rgbd make of files: z = value * depth_scale [m]; 0, NaN, infinity and negative values are holes (NaN).
/// Copies; no view is needed afterwards. Fails with invalid_option or bad_input.
SWARMFIT_API Expected<Cloud> make_cloud(const DepthView& depth, const Intrinsics& intrinsics, double depth_scale,
                                        const ColourView& colour = {});

}  // namespace swarmfit
