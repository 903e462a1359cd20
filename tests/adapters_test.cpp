// Other libraries' clouds as views of points: the library itself where it is a dependency, types of the others' shape.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include <swarmfit/adapters/eigen.hpp>
#include <swarmfit/adapters/open3d.hpp>
#include <swarmfit/adapters/opencv.hpp>
#include <swarmfit/adapters/pcl.hpp>
#include <swarmfit/adapters/point_cloud2.hpp>
#include <swarmfit/adapters/sac_segmentation.hpp>
#include <swarmfit/swarmfit.hpp>

namespace swarmfit {
namespace {

/// z = 0.5 with 900 points, x = 1 with 500, 100 anywhere; the last point is not a number.
Eigen::Matrix3Xf two_planes() {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> at(0, 1), noise(-0.002F, 0.002F);
  Eigen::Matrix3Xf points(3, 1501);
  for (int i = 0; i < 1500; ++i) {
    points.col(i) = Eigen::Vector3f(at(generator), at(generator), at(generator));
    if (i < 900) points(2, i) = 0.5F + noise(generator);
    if (i >= 900 && i < 1400) points(0, i) = 1 + noise(generator);
  }
  points.col(1500).setConstant(NAN);
  return points;
}

void expect_two_planes(const Expected<FitResult>& result) {
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 2U);
  EXPECT_NEAR(std::abs(result->models[0].normal().z()), 1, 1e-3);
  EXPECT_NEAR(std::abs(result->models[1].normal().x()), 1, 1e-3);
}

FitOptions options() {
  FitOptions o;
  o.threshold = 0.006;
  return o;
}

TEST(EigenAdapter, LooksAtWhatLiesThere) {
  const Eigen::Matrix3Xf columns = two_planes();
  expect_two_planes(fit(adapters::view_columns(columns), options()));
  const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> rows = columns.transpose().cast<double>();
  const PointsView of_rows = adapters::view_rows(rows);
  EXPECT_EQ(of_rows.data(), rows.data());
  EXPECT_EQ(of_rows.scalar(), PointsView::Scalar::float64);
  EXPECT_EQ(of_rows.size(), 1501U);
  expect_two_planes(fit(of_rows, options()));

  Eigen::Matrix4Xf homogeneous(4, columns.cols());
  homogeneous << columns, Eigen::RowVectorXf::Ones(columns.cols());
  const PointsView block = adapters::view_columns(homogeneous.topRows<3>());
  EXPECT_EQ(block.stride(), 4 * sizeof(float));
  EXPECT_EQ(block.dimension(), 3);
  expect_two_planes(fit(block, options()));
  const Eigen::Map<const Eigen::Matrix3Xf, 0, Eigen::OuterStride<>> map(homogeneous.data(), 3, homogeneous.cols(), Eigen::OuterStride<>(4));
  expect_two_planes(fit(adapters::view_columns(map), options()));

  std::vector<Eigen::Vector3d> points;
  for (const auto& p : columns.colwise()) points.emplace_back(p.cast<double>());
  expect_two_planes(fit(adapters::view(points), options()));
  EXPECT_EQ(adapters::view(std::vector<Eigen::Vector2f>{}).size(), 0U);
}

TEST(OpenCvAdapter, MatricesAndPoints) {
  const Eigen::Matrix3Xf columns = two_planes();
  cv::Mat list(1501, 3, CV_32F);
  for (int i = 0; i < 1501; ++i) {
    for (int d = 0; d < 3; ++d) list.at<float>(i, d) = columns(d, i);
  }
  const auto rows = adapters::view(list);
  ASSERT_TRUE(rows);
  expect_two_planes(fit(*rows, options()));
  const cv::Mat grid = list.rowRange(0, 1500).clone().reshape(3, 30);
  ASSERT_EQ(grid.size(), cv::Size(50, 30));
  const auto organised = adapters::view(grid);
  ASSERT_TRUE(organised);
  EXPECT_EQ(organised->size(), 1500U);
  const auto result = fit(*organised, options());
  expect_two_planes(result);
  const cv::Mat labels = adapters::label_image(*result, grid.size());
  EXPECT_EQ(cv::countNonZero(labels == 1), static_cast<int>(result->models[0].inliers));

  std::vector<cv::Point3f> points;
  for (const auto& p : columns.colwise()) points.emplace_back(p.x(), p.y(), p.z());
  expect_two_planes(fit(adapters::view(points), options()));
  EXPECT_EQ(adapters::view(std::vector<cv::Point2d>(4)).dimension(), 2);

  const auto gaps = adapters::view(grid.colRange(0, 20));
  ASSERT_FALSE(gaps);
  EXPECT_EQ(gaps.error().message, "the matrix has gaps between its rows, must be continuous: clone() it");
  EXPECT_FALSE(adapters::view(cv::Mat(3, 3, CV_8U)));
}

TEST(OpenCvAdapter, PairsOfImagePoints) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> at(0, 600);
  std::vector<cv::Point2f> first, second;
  const cv::Matx33d truth(1.1, 0.02, 10, 0.01, 0.95, -5, 1e-5, 2e-5, 1);
  for (int i = 0; i < 300; ++i) {
    first.emplace_back(at(generator), at(generator));
    const cv::Vec3d q = truth * cv::Vec3d(first.back().x, first.back().y, 1);
    second.emplace_back(static_cast<float>(q[0] / q[2]), static_cast<float>(q[1] / q[2]));
  }
  const auto matches = adapters::pairs(first, second);
  FitOptions o;
  o.model = ModelType::homography;
  const auto result = fit(adapters::view(matches), o);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->models.size(), 1U);
  const cv::Matx33d h = adapters::matrix(result->models[0]);
  EXPECT_LT(cv::norm(h * (1 / h(2, 2)) - truth), 1e-2);
}

TEST(OpenCvAdapter, DepthAndColour) {
  const cv::Mat depth(2, 3, CV_16U, cv::Scalar(1500)), bgr(2, 3, CV_8UC3, cv::Scalar(3, 2, 1));
  const auto cloud = adapters::make_cloud(depth, {500, 500, 1, 1}, 0.001, bgr);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->width, 3);
  EXPECT_FLOAT_EQ(cloud->values32[2], 1.5F);
  EXPECT_EQ(cloud->rgb[0], 1);
  EXPECT_FALSE(adapters::make_cloud(bgr, {500, 500, 1, 1}, 0.001));
  EXPECT_FALSE(adapters::make_cloud(depth, {500, 500, 1, 1}, 0.001, depth));
}

// Of PCL's shape.
struct PointXYZ {
  float x, y, z, padding;
};
struct PointXYZRGB {
  float x, y, z, padding;
  std::uint8_t b, g, r, a;
  float more[3];
};
struct Header {
  std::string frame_id;
};
template <class Point>
struct PointCloud {
  using PointType = Point;
  Header header;
  std::vector<Point> points;
  std::uint32_t width = 0, height = 1;
};
struct PointIndices {
  Header header;
  std::vector<int> indices;
};
struct ModelCoefficients {
  Header header;
  std::vector<float> values;
};

std::shared_ptr<PointCloud<PointXYZ>> pcl_cloud() {
  auto cloud = std::make_shared<PointCloud<PointXYZ>>();
  cloud->header.frame_id = "camera";
  const Eigen::Matrix3Xf points = two_planes();
  for (const auto& p : points.colwise()) cloud->points.push_back({p.x(), p.y(), p.z(), 1});
  cloud->width = static_cast<std::uint32_t>(cloud->points.size());
  return cloud;
}

TEST(PclAdapter, CloudsAndIndices) {
  const auto cloud = pcl_cloud();
  const PointsView view = adapters::view(*cloud);
  EXPECT_EQ(view.data(), cloud->points.data());
  EXPECT_EQ(view.stride(), sizeof(PointXYZ));
  const auto result = fit(view, options());
  expect_two_planes(result);
  const std::vector<int> first = adapters::indices(result->labels, 1);
  EXPECT_EQ(first.size(), result->models[0].inliers);
  const auto all = adapters::indices_of_all(result->labels, result->models.size());
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0], first);
  EXPECT_EQ(all[1].size(), result->models[1].inliers);

  PointCloud<PointXYZRGB> coloured;
  coloured.width = 2;
  coloured.height = 2;
  for (std::uint8_t i = 0; i < 4; ++i) coloured.points.push_back({i * 1.0F, 0, 1, 1, 10, 20, i, 255, {}});
  const Cloud copy = adapters::to_cloud(coloured);
  EXPECT_TRUE(copy.organised());
  EXPECT_EQ(copy.rgb[9], 3);
  EXPECT_EQ(copy.rgb[11], 10);
  EXPECT_EQ(copy.values32[9], 3);
}

TEST(SacSegmentation, FindsThePlaneWithTheMostSupport) {
  SACSegmentation<PointXYZ> seg;
  seg.setOptimizeCoefficients(true);
  seg.setModelType(0);
  seg.setMethodType(0);
  seg.setDistanceThreshold(0.006);
  seg.setMaxIterations(1000);
  seg.setInputCloud(pcl_cloud());
  PointIndices inliers;
  ModelCoefficients coefficients;
  seg.segment(inliers, coefficients);
  ASSERT_EQ(coefficients.values.size(), 4U) << seg.error();
  EXPECT_NEAR(std::abs(coefficients.values[2]), 1, 1e-3);
  EXPECT_NEAR(std::abs(coefficients.values[3]), 0.5, 1e-3);
  EXPECT_GE(inliers.indices.size(), 900U);
  EXPECT_EQ(inliers.header.frame_id, "camera");
  EXPECT_EQ(coefficients.header.frame_id, "camera");

  // What is left, as loops over PCL's extraction go on: indices are the cloud's.
  auto left = std::make_shared<std::vector<int>>();
  for (int i = 0, k = 0; i < 1501; ++i) {
    if (k < static_cast<int>(inliers.indices.size()) && inliers.indices[static_cast<std::size_t>(k)] == i) {
      ++k;
    } else {
      left->push_back(i);
    }
  }
  seg.setIndices(left);
  seg.segment(inliers, coefficients);
  ASSERT_EQ(coefficients.values.size(), 4U) << seg.error();
  EXPECT_NEAR(std::abs(coefficients.values[0]), 1, 1e-3);
  for (const int i : inliers.indices) EXPECT_TRUE(i >= 900 && i < 1500);

  seg.setIndices(std::shared_ptr<PointIndices>());
  seg.setModelType(9);
  seg.setAxis(Eigen::Vector3f::UnitX());
  seg.setEpsAngle(0.1);
  seg.segment(inliers, coefficients);
  ASSERT_EQ(coefficients.values.size(), 4U) << seg.error();
  EXPECT_NEAR(std::abs(coefficients.values[0]), 1, 1e-2);
}

TEST(SacSegmentation, CoefficientsHaveNoNegativeZero) {
  Model model;
  model.parameters.resize(4);
  model.parameters << -0.0, 0.0, -1.0, 1.0;
  ModelCoefficients coefficients;
  adapters::to_coefficients(model, coefficients);
  ASSERT_EQ(coefficients.values.size(), 4U);
  EXPECT_FALSE(std::signbit(coefficients.values[0]));
  EXPECT_EQ(coefficients.values[2], -1.0F);
}

TEST(SacSegmentation, RadiusLimits) {
  std::mt19937 generator(3);
  std::normal_distribution<float> normal;
  auto cloud = std::make_shared<PointCloud<PointXYZ>>();
  for (const auto& [radius, count, x] : {std::array{0.3F, 2000.0F, 0.0F}, std::array{0.1F, 800.0F, 1.0F}}) {
    for (int i = 0; i < static_cast<int>(count); ++i) {
      const Eigen::Vector3f p = radius * Eigen::Vector3f(normal(generator), normal(generator), normal(generator)).normalized();
      cloud->points.push_back({x + p.x(), p.y(), p.z(), 1});
    }
  }
  SACSegmentation<PointXYZ> seg;
  seg.setInputCloud(cloud);
  seg.setModelType(4);
  seg.setDistanceThreshold(0.005);
  seg.setRadiusLimits(0.05, 0.15);
  PointIndices inliers;
  ModelCoefficients coefficients;
  seg.segment(inliers, coefficients);
  ASSERT_EQ(coefficients.values.size(), 4U) << seg.error();
  EXPECT_NEAR(coefficients.values[0], 1, 5e-3);
  EXPECT_NEAR(coefficients.values[3], 0.1, 5e-3);
}

TEST(SacSegmentation, SaysWhyItIsEmpty) {
  SACSegmentation<PointXYZ> seg;
  PointIndices inliers{{}, {1, 2}};
  ModelCoefficients coefficients;
  seg.segment(inliers, coefficients);
  EXPECT_TRUE(inliers.indices.empty());
  EXPECT_NE(seg.error().find("setInputCloud"), std::string::npos);
  seg.setInputCloud(pcl_cloud());
  seg.setModelType(6);
  seg.segment(inliers, coefficients);
  EXPECT_NE(seg.error().find("model type is 6, must be SACMODEL_PLANE"), std::string::npos);
  seg.setModelType(0);
  seg.setDistanceThreshold(-1);
  seg.segment(inliers, coefficients);
  EXPECT_NE(seg.error().find("threshold is -1"), std::string::npos);
  seg.setDistanceThreshold(0.01);
  seg.setInputCloud(std::make_shared<PointCloud<PointXYZ>>());
  seg.segment(inliers, coefficients);
  EXPECT_NE(seg.error().find("points is 0"), std::string::npos);
}

// Of Open3D's shape.
struct Open3dPointCloud {
  std::vector<Eigen::Vector3d> points_, normals_, colors_;
};

TEST(Open3dAdapter, CloudsAndColours) {
  Open3dPointCloud cloud;
  const Eigen::Matrix3Xf points = two_planes();
  for (const auto& p : points.colwise()) cloud.points_.emplace_back(p.cast<double>());
  const PointsView view = adapters::view(cloud);
  EXPECT_EQ(view.data(), cloud.points_.data());
  const auto result = fit(view, options());
  expect_two_planes(result);
  EXPECT_EQ(adapters::indices<std::size_t>(result->labels, 2).size(), result->models[1].inliers);
  EXPECT_FALSE(adapters::to_cloud(cloud).coloured());
  cloud.colors_.assign(cloud.points_.size(), Eigen::Vector3d(1, 0.5, -1));
  const Cloud copy = adapters::to_cloud(cloud);
  EXPECT_EQ(copy.size(), cloud.points_.size());
  EXPECT_EQ((std::array{copy.rgb[0], copy.rgb[1], copy.rgb[2]}), (std::array<std::uint8_t, 3>{255, 128, 0}));
}

// Of the shape of sensor_msgs/PointCloud2.
struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 7;
  std::uint32_t count = 1;
};
struct Message {
  std::uint32_t height = 1, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = true;
};

/// 50 x 30 points of 20 bytes (intensity, x, y, z, rgb), rows `gap` bytes apart.
Message message(std::uint32_t gap) {
  const Eigen::Matrix3Xf points = two_planes();
  Message m;
  m.width = 50;
  m.height = 30;
  m.fields = {{"intensity", 0, 7, 1}, {"x", 4, 7, 1}, {"y", 8, 7, 1}, {"z", 12, 7, 1}, {"rgb", 16, 7, 1}};
  m.point_step = 20;
  m.row_step = 50 * 20 + gap;
  m.data.resize(std::size_t{30} * m.row_step);
  for (std::size_t i = 0; i < 1500; ++i) {
    std::uint8_t* p = m.data.data() + i / 50 * m.row_step + i % 50 * m.point_step;
    std::memcpy(p + 4, points.col(static_cast<Eigen::Index>(i)).data(), 12);
    const std::uint32_t colour = 0x010203;
    std::memcpy(p + 16, &colour, 4);
  }
  return m;
}

TEST(PointCloud2Adapter, LooksAtMessages) {
  const Message tight = message(0);
  const auto view = adapters::view(tight);
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_EQ(view->data(), tight.data.data() + 4);
  expect_two_planes(fit(*view, options()));

  const Message loose = message(8);
  EXPECT_FALSE(adapters::view(loose));
  const auto cloud = adapters::to_cloud(loose);
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(cloud->height, 30);
  EXPECT_EQ((std::array{cloud->rgb[0], cloud->rgb[1], cloud->rgb[2]}), (std::array<std::uint8_t, 3>{1, 2, 3}));
  expect_two_planes(fit(cloud->points(), options()));
}

TEST(PointCloud2Adapter, NamesWhatIsWrong) {
  const auto error_of = [](auto spoil) {
    Message m = message(0);
    spoil(m);
    const auto view = adapters::view(m);
    return view ? std::string("nothing") : view.error().message;
  };
  EXPECT_EQ(error_of([](Message& m) { m.fields[3].name = "zz"; }), "the PointCloud2 lacks a field, must have x, y and z");
  EXPECT_NE(error_of([](Message& m) { m.fields[3].offset = 0; }).find("side by side"), std::string::npos);
  EXPECT_NE(error_of([](Message& m) { m.fields[1].datatype = 2; }).find("datatypes 2, 7, 7"), std::string::npos);
  EXPECT_NE(error_of([](Message& m) { m.data.pop_back(); }).find("holds 29999 bytes, must hold >= 30000"), std::string::npos);
  EXPECT_NE(error_of([](Message& m) { m.is_bigendian = true; }).find("byte order"), std::string::npos);
  EXPECT_NE(error_of([](Message& m) { m.row_step = 10; }).find("row_step 10"), std::string::npos);
}

}  // namespace
}  // namespace swarmfit
