// Depth images and RGB-D frames to organised clouds.
#include <cmath>
#include <limits>
#include <vector>

#include <swarmfit/cloud.hpp>

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

void take_colours(const cv::Mat& bgr, Cloud& cloud) {
  cloud.rgb.resize(3 * bgr.total());
  std::uint8_t* out = cloud.rgb.data();
  for (int v = 0; v < bgr.rows; ++v) {
    const std::uint8_t* row = bgr.ptr<std::uint8_t>(v);
    for (int u = 0; u < bgr.cols; ++u, row += 3, out += 3) {
      out[0] = row[2];
      out[1] = row[1];
      out[2] = row[0];
    }
  }
}

namespace {

Expected<Cloud> depth_cloud(const std::filesystem::path& file, const Intrinsics& intrinsics, double depth_scale) {
  if (auto ok = check_intrinsics(intrinsics); !ok) return tl::unexpected(ok.error());
  if (!(depth_scale > 0) || !std::isfinite(depth_scale)) {
    return fail(Error::Kind::invalid_option, fmt::format("depth scale: {}, must be > 0 [m a unit]", depth_scale));
  }
  const auto image = read_depth_image(file);
  if (!image) return tl::unexpected(image.error());
  cv::Mat z(image->size(), CV_32F);
  const auto scale = static_cast<float>(depth_scale);
  for (int v = 0; v < z.rows; ++v) {
    const std::uint16_t* from = image->ptr<std::uint16_t>(v);
    float* to = z.ptr<float>(v);
    for (int u = 0; u < z.cols; ++u) to[u] = from[u] ? static_cast<float>(from[u]) * scale : std::numeric_limits<float>::quiet_NaN();
  }
  Cloud cloud;
  back_project(z, intrinsics, cloud);
  return cloud;
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
    io::take_colours(*image, *cloud);
    return cloud;
  });
}

}  // namespace swarmfit
