#include "host/io/stereo.hpp"

#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <swarmfit/cloud.hpp>

#include "host/io/calib.hpp"
#include "host/io/file.hpp"
#include "host/io/grid.hpp"
#include "host/io/image.hpp"
#include "host/io/rectify.hpp"

namespace swarmfit {
namespace io {

cv::Mat disparity_map(const cv::Mat& left, const cv::Mat& right, int disparities) {
  const int range = (disparities + 15) / 16 * 16;
  // Grey finds more than colour, in half the time. SGBM leaves out the first `range` columns; a replicated border brings them in.
  const auto widened = [range](const cv::Mat& image) {
    cv::Mat grey, wide;
    cv::cvtColor(image, grey, cv::COLOR_RGB2GRAY);
    cv::copyMakeBorder(grey, wide, 0, 0, range, 0, cv::BORDER_REPLICATE);
    return wide;
  };
  constexpr int kBlock = 5;
  // Small penalties: larger ones pull slanted surfaces towards fronto-parallel steps, which tilts their planes.
  constexpr int kSmallStep = 2 * kBlock * kBlock, kLargeStep = 24 * kBlock * kBlock;
  constexpr int kLeftRight = 1;  // most difference of the two directions [px]
  constexpr int kPrefilterCap = 31;
  constexpr int kUniqueness = 10;  // the best is better than the second by this [%]
  constexpr int kSpeckleSize = 100, kSpeckleRange = 2;
  const auto matcher = cv::StereoSGBM::create(0, range, kBlock, kSmallStep, kLargeStep, kLeftRight, kPrefilterCap, kUniqueness,
                                              kSpeckleSize, kSpeckleRange, cv::StereoSGBM::MODE_HH);
  cv::Mat fixed;
  matcher->compute(widened(left), widened(right), fixed);
  cv::Mat d;
  fixed.colRange(range, fixed.cols).convertTo(d, CV_32F, 1.0 / static_cast<int>(cv::StereoMatcher::DISP_SCALE));
  d.setTo(std::numeric_limits<float>::quiet_NaN(), d < 0);
  return d;
}

namespace {

Expected<Cloud> stereo_cloud(const std::filesystem::path& left_file, const std::filesystem::path& right_file,
                             const std::filesystem::path& calib_file) {
  const auto calib = read_calibration(calib_file);
  if (!calib) return tl::unexpected(calib.error());
  const auto left = read_colour_image(left_file);
  if (!left) return tl::unexpected(left.error());
  const auto right = read_colour_image(right_file);
  if (!right) return tl::unexpected(right.error());
  if (right->size() != left->size()) {
    return bad_input(right_file, "is {} x {} pixels, must be {} x {} as {}", right->cols, right->rows, left->cols, left->rows,
                     left_file.string());
  }
  if ((calib->width && calib->width != left->cols) || (calib->height && calib->height != left->rows)) {
    return bad_input(left_file, "is {} x {} pixels, must be {} x {} as {} says", left->cols, left->rows, calib->width, calib->height,
                     calib_file.string());
  }
  if (calib->disparities > left->cols) {
    return bad_input(calib_file, "field ndisp: {}, must be at most the image's width {}", calib->disparities, left->cols);
  }
  const cv::Mat d = disparity_map(*left, level_rows(*left, *right, calib->disparities), calib->disparities);
  cv::Mat z(d.size(), CV_32F);
  const double bf = calib->baseline * calib->left.fx;
  for (int v = 0; v < z.rows; ++v) {
    for (int u = 0; u < z.cols; ++u) {
      const double shift = d.at<float>(v, u) + calib->doffs;
      z.at<float>(v, u) = shift > 0 ? static_cast<float>(bf / shift) : std::numeric_limits<float>::quiet_NaN();
    }
  }
  Cloud cloud;
  back_project(z, calib->left, cloud);
  take_colours(*left, true, cloud);
  cloud.passive_stereo = true;
  return cloud;
}

}  // namespace
}  // namespace io

Expected<Cloud> read_stereo(const std::filesystem::path& left, const std::filesystem::path& right, const std::filesystem::path& calib) {
  return io::guarded(left, Error::Kind::bad_input, [&] { return io::stereo_cloud(left, right, calib); });
}

}  // namespace swarmfit
