// OpenCV's matrices and points. Needs opencv2/core.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/images.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit::adapters {

/// The matrix's own memory: H x W of 2, 3 or 4 channels (what reprojectImageTo3D gives, what findContours takes), a point an element; or
/// N x D of one channel, a point a row. CV_32F or CV_64F. Fails with bad_input for anything else, and for an image with gaps between its
/// rows.
inline Expected<PointsView> view(const cv::Mat& matrix) {
  const auto complain = [](const std::string& what) { return fail(Error::Kind::bad_input, "the matrix " + what); };
  if (matrix.dims != 2) return complain("has " + std::to_string(matrix.dims) + " dimensions, must have 2");
  if (matrix.depth() != CV_32F && matrix.depth() != CV_64F)
    return complain("is of depth " + std::string(cv::depthToString(matrix.depth())) + ", must be CV_32F or CV_64F");
  const auto scalar = matrix.depth() == CV_32F ? PointsView::Scalar::float32 : PointsView::Scalar::float64;
  if (matrix.channels() == 1) return PointsView(matrix.data, scalar, matrix.cols, static_cast<std::size_t>(matrix.rows), matrix.step[0]);
  if (matrix.cols == 1) return PointsView(matrix.data, scalar, matrix.channels(), static_cast<std::size_t>(matrix.rows), matrix.step[0]);
  if (!matrix.isContinuous()) return complain("has gaps between its rows, must be continuous: clone() it");
  return PointsView(matrix.data, scalar, matrix.channels(), matrix.total(), matrix.elemSize());
}

/// std::vector<cv::Point3f> and its likes: Point2f, Point2d, Point3d, Vec4f, Vec4d.
template <class Scalar>
PointsView view(const std::vector<cv::Point3_<Scalar>>& points) {
  return PointsView({points.empty() ? nullptr : &points.front().x, 3 * points.size()}, 3);
}
template <class Scalar>
PointsView view(const std::vector<cv::Point_<Scalar>>& points) {
  return PointsView({points.empty() ? nullptr : &points.front().x, 2 * points.size()}, 2);
}
template <class Scalar, int Size>
PointsView view(const std::vector<cv::Vec<Scalar, Size>>& points) {
  return PointsView({points.empty() ? nullptr : points.front().val, Size * points.size()}, Size);
}

/// What matches two images' points, for homographies and fundamental matrices: view(pairs(first, second)) would look at memory that is
/// gone; keep the vector. The lists are of one size.
template <class Scalar>
std::vector<cv::Vec<Scalar, 4>> pairs(const std::vector<cv::Point_<Scalar>>& first, const std::vector<cv::Point_<Scalar>>& second) {
  std::vector<cv::Vec<Scalar, 4>> all;
  all.reserve(first.size());
  for (std::size_t i = 0; i < first.size() && i < second.size(); ++i) all.emplace_back(first[i].x, first[i].y, second[i].x, second[i].y);
  return all;
}

/// homography, fundamental: as findHomography and findFundamentalMat give them, but of norm 1. Of these two only.
inline cv::Matx33d matrix(const Model& model) { return cv::Matx33d(model.parameters.data()); }

/// Labels as an image over the result's own memory, CV_16U, of the cloud's grid; the result must outlive it.
inline cv::Mat label_image(const FitResult& result, cv::Size size) {
  return cv::Mat(size, CV_16U, const_cast<std::uint16_t*>(result.labels.data()));
}

/// CV_16U, or CV_32F, and CV_8UC3 (blue first, as OpenCV reads images; an empty one: none), registered to each other. Copies.
inline Expected<Cloud> make_cloud(const cv::Mat& depth, const Intrinsics& intrinsics, double depth_scale, const cv::Mat& bgr = {}) {
  if (depth.type() != CV_16U && depth.type() != CV_32F) {
    return fail(Error::Kind::bad_input,
                "the depth image is of type " + std::string(cv::typeToString(depth.type())) + ", must be CV_16U or CV_32F");
  }
  if (!bgr.empty() && bgr.type() != CV_8UC3) {
    return fail(Error::Kind::bad_input, "the colour image is of type " + std::string(cv::typeToString(bgr.type())) + ", must be CV_8UC3");
  }
  const DepthView z{depth.data, depth.type() == CV_16U ? DepthView::Scalar::uint16 : DepthView::Scalar::float32, depth.cols, depth.rows,
                    depth.step[0]};
  if (bgr.empty()) return swarmfit::make_cloud(z, intrinsics, depth_scale);
  return swarmfit::make_cloud(z, intrinsics, depth_scale, {bgr.data, ColourView::Order::bgr, bgr.cols, bgr.rows, bgr.step[0]});
}

}  // namespace swarmfit::adapters
