// Depth images and RGB-D frames to organised clouds.
#include <cmath>
#include <limits>
#include <vector>

#include <swarmfit/cloud.hpp>
#include <swarmfit/images.hpp>

#include "host/common/thrown.hpp"
#include "host/io/file.hpp"
#include "host/io/grid.hpp"
#include "host/io/image.hpp"

namespace swarmfit {
namespace io {

Expected<> check_intrinsics(const Intrinsics& k) {
  const auto complain = [](const char* field, double value, const char* bound) {
    return fail(Error::Kind::invalid_option, fmt::format("intrinsics {}: {}, must be {}", field, value, bound));
  };
  if (!(k.fx > 0) || !std::isfinite(k.fx)) return complain("fx", k.fx, "> 0 [px]");
  if (!(k.fy > 0) || !std::isfinite(k.fy)) return complain("fy", k.fy, "> 0 [px]");
  if (!std::isfinite(k.cx)) return complain("cx", k.cx, "finite [px]");
  if (!std::isfinite(k.cy)) return complain("cy", k.cy, "finite [px]");
  return {};
}

void back_project(const cv::Mat& z, const Intrinsics& k, Cloud& cloud) {
  cloud.dimension = 3;
  cloud.width = z.cols;
  cloud.height = z.rows;
  cloud.intrinsics = k;
  cloud.values32.resize(3 * z.total());
  std::vector<float> x_of_u(static_cast<std::size_t>(z.cols));
  for (int u = 0; u < z.cols; ++u) x_of_u[static_cast<std::size_t>(u)] = static_cast<float>((u - k.cx) / k.fx);
  float* out = cloud.values32.data();
  for (int v = 0; v < z.rows; ++v) {
    const auto y_of_v = static_cast<float>((v - k.cy) / k.fy);
    const float* row = z.ptr<float>(v);
    for (int u = 0; u < z.cols; ++u, out += 3) {
      out[0] = row[u] * x_of_u[static_cast<std::size_t>(u)];
      out[1] = row[u] * y_of_v;
      out[2] = row[u];
    }
  }
}

void take_colours(const cv::Mat& image, bool rgb, Cloud& cloud) {
  const int red = rgb ? 0 : 2;
  cloud.rgb.resize(3 * image.total());
  std::uint8_t* out = cloud.rgb.data();
  for (int v = 0; v < image.rows; ++v) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(v);
    for (int u = 0; u < image.cols; ++u, row += 3, out += 3) {
      out[0] = row[red];
      out[1] = row[1];
      out[2] = row[2 - red];
    }
  }
}

namespace {

Expected<> check_depth_scale(double depth_scale) {
  if (depth_scale > 0 && std::isfinite(depth_scale)) return {};
  return fail(Error::Kind::invalid_option, fmt::format("depth scale: {}, must be > 0 [m a unit]", depth_scale));
}

/// Depths in metres, CV_32F; what is no distance becomes NaN.
template <class Value>
cv::Mat metres(const cv::Mat& image, double depth_scale) {
  cv::Mat z(image.size(), CV_32F);
  const auto scale = static_cast<float>(depth_scale);
  for (int v = 0; v < z.rows; ++v) {
    const Value* from = image.ptr<Value>(v);
    float* to = z.ptr<float>(v);
    for (int u = 0; u < z.cols; ++u) {
      const auto value = static_cast<float>(from[u]);
      to[u] = value > 0 && value <= std::numeric_limits<float>::max() ? value * scale : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return z;
}

Expected<Cloud> depth_cloud(const std::filesystem::path& file, const Intrinsics& intrinsics, double depth_scale) {
  if (auto ok = check_intrinsics(intrinsics); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_depth_scale(depth_scale); !ok) return tl::unexpected(ok.error());
  const auto image = read_depth_image(file);
  if (!image) return tl::unexpected(image.error());
  Cloud cloud;
  back_project(metres<std::uint16_t>(*image, depth_scale), intrinsics, cloud);
  return cloud;
}

/// Somebody's pixels as a matrix; nothing is copied, nothing written to them.
template <class View>
Expected<cv::Mat> matrix(const View& view, const char* name, int type) {
  if (!view.data || view.width < 1 || view.height < 1) {
    return fail(Error::Kind::bad_input, fmt::format("the {} image is {} x {} pixels, must be >= 1 x 1", name, view.width, view.height));
  }
  const std::size_t tight = CV_ELEM_SIZE(type) * static_cast<std::size_t>(view.width);
  if (view.row_step != 0 && view.row_step < tight) {
    return fail(Error::Kind::invalid_option, fmt::format("{} row_step: {}, must be 0 or >= {} [bytes]", name, view.row_step, tight));
  }
  return cv::Mat(view.height, view.width, type, const_cast<void*>(view.data), view.row_step ? view.row_step : tight);
}

}  // namespace
}  // namespace io

Expected<Cloud> read_depth(const std::filesystem::path& depth, const Intrinsics& intrinsics, double depth_scale) {
  return io::guarded(depth, Error::Kind::bad_input, [&] { return io::depth_cloud(depth, intrinsics, depth_scale); });
}

Expected<Cloud> read_rgbd(const std::filesystem::path& color, const std::filesystem::path& depth, const Intrinsics& intrinsics,
                          double depth_scale) {
  return io::guarded(color, Error::Kind::bad_input, [&]() -> Expected<Cloud> {
    auto cloud = read_depth(depth, intrinsics, depth_scale);
    if (!cloud) return cloud;
    const auto image = io::read_colour_image(color);
    if (!image) return tl::unexpected(image.error());
    if (image->cols != cloud->width || image->rows != cloud->height) {
      return io::bad_input(color, "is {} x {} pixels, must be {} x {} as {}", image->cols, image->rows, cloud->width, cloud->height,
                           depth.string());
    }
    io::take_colours(*image, true, *cloud);
    return cloud;
  });
}

Expected<Cloud> make_cloud(const DepthView& depth, const Intrinsics& intrinsics, double depth_scale, const ColourView& colour) try {
  if (auto ok = io::check_intrinsics(intrinsics); !ok) return tl::unexpected(ok.error());
  if (auto ok = io::check_depth_scale(depth_scale); !ok) return tl::unexpected(ok.error());
  const bool whole = depth.scalar == DepthView::Scalar::uint16;
  const auto image = io::matrix(depth, "depth", whole ? CV_16U : CV_32F);
  if (!image) return tl::unexpected(image.error());
  Cloud cloud;
  io::back_project(whole ? io::metres<std::uint16_t>(*image, depth_scale) : io::metres<float>(*image, depth_scale), intrinsics, cloud);
  if (!colour.data) return cloud;

  const auto pixels = io::matrix(colour, "colour", CV_8UC3);
  if (!pixels) return tl::unexpected(pixels.error());
  if (pixels->size() != image->size()) {
    return fail(Error::Kind::bad_input, fmt::format("the colour image is {} x {} pixels, must be {} x {} as the depth image", pixels->cols,
                                                    pixels->rows, image->cols, image->rows));
  }
  io::take_colours(*pixels, colour.order == ColourView::Order::rgb, cloud);
  return cloud;
} catch (...) {
  return common::error_of_thrown(Error::Kind::bad_input,
                                 [&] { return fmt::format("no memory for {} x {} pixels", depth.width, depth.height); });
}

}  // namespace swarmfit
