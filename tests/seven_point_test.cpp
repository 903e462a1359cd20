// Fundamental matrices through seven correspondences, on every instruction set.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "kernels/cpu/seven_point_kernels.hpp"

namespace swarmfit::kernels {
namespace {

using Matrix = Eigen::Matrix3d;

/// Seven points before two cameras a lane; the truth is one matrix for all.
struct Views {
  SevenPointSamples samples;
  Matrix truth;

  explicit Views(unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    const Matrix turn = Eigen::AngleAxisd(0.3 * unit(engine), Eigen::Vector3d(unit(engine), 1, unit(engine)).normalized()).matrix();
    const Eigen::Vector3d shift(unit(engine), unit(engine), 0.5 * unit(engine));
    Matrix cross;
    cross << 0, -shift[2], shift[1], shift[2], 0, -shift[0], -shift[1], shift[0], 0;
    truth = (cross * turn).normalized();
    for (std::size_t lane = 0; lane < kSevenPointLanes; ++lane) {
      for (auto& point : samples.points) {
        const Eigen::Vector3d p(2 * unit(engine), 2 * unit(engine), 5 + 2 * unit(engine)), q = turn * p + shift;
        const std::array<double, 4> row{p[0] / p[2], p[1] / p[2], q[0] / q[2], q[1] / q[2]};
        for (std::size_t c = 0; c < 4; ++c) point[c][lane] = row[c];
      }
    }
  }
  Eigen::Vector3d at(std::size_t image, std::size_t point, std::size_t lane) const {
    return {samples.points[point][2 * image][lane], samples.points[point][2 * image + 1][lane], 1};
  }
};

/// The k-th matrix of a lane, of unit length in the frame of the points.
Matrix matrix(const Views& views, const SevenPointPencils& pencils, std::size_t lane, std::size_t k) {
  Matrix f = Matrix::Zero();
  for (std::size_t e = 0; e < 8; ++e) {
    f(static_cast<int>(e / 3), static_cast<int>(e % 3)) = pencils.one[e][lane] + pencils.root[k][lane] * pencils.other[e][lane];
  }
  Matrix to[2];
  for (std::size_t image = 0; image < 2; ++image) {
    const double scale = pencils.scale[image][lane];
    const Eigen::Vector3d origin = views.at(image, 0, lane);
    to[image] << scale, 0, -scale * origin[0], 0, scale, -scale * origin[1], 0, 0, 1;
  }
  return (to[1].transpose() * f * to[0]).normalized();
}

class SevenPoints : public testing::TestWithParam<const cpu::SevenPointKernels*> {};

TEST_P(SevenPoints, OneOfTheSolutionsIsTheMotionAndAllMeetTheConstraints) {
  std::size_t solutions = 0, several = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const Views views(seed);
    SevenPointPencils pencils;
    GetParam()->solve(views.samples, pencils);
    for (std::size_t lane = 0; lane < kSevenPointLanes; ++lane) {
      double nearest = 2;
      for (std::size_t k = 0; k < 3; ++k) {
        if ((pencils.kept[lane] >> k & 1U) == 0) continue;
        ++solutions;
        several += k > 0 ? 1 : 0;
        const Matrix f = matrix(views, pencils, lane, k);
        for (std::size_t i = 0; i < 7; ++i) EXPECT_NEAR(views.at(1, i, lane).dot(f * views.at(0, i, lane)), 0, 1e-9);
        EXPECT_NEAR(f.determinant(), 0, 1e-9);
        nearest = std::min({nearest, (f - views.truth).norm(), (f + views.truth).norm()});
      }
      EXPECT_LT(nearest, 1e-4) << "seed " << seed << ", lane " << lane;
    }
  }
  EXPECT_GT(several, solutions / 20);
}

TEST_P(SevenPoints, LanesAreToldApartAndDegenerateOnesGiveNone) {
  Views views(7);
  SevenPointPencils all, some;
  GetParam()->solve(views.samples, all);
  // A point twice; all at one place; a point that has moved behind a camera's back, as its line says.
  for (std::size_t c = 0; c < 4; ++c) views.samples.points[3][c][1] = views.samples.points[5][c][1];
  for (auto& point : views.samples.points) {
    for (std::size_t c = 0; c < 4; ++c) point[c][4] = 0.25;
  }
  GetParam()->solve(views.samples, some);
  EXPECT_EQ(some.kept[1], 0);
  EXPECT_EQ(some.kept[4], 0);
  for (const std::size_t lane : {0, 2, 3, 5, 6, 7}) {
    EXPECT_EQ(some.kept[lane], all.kept[lane]);
    EXPECT_EQ(some.root[0][lane], all.root[0][lane]);
  }
}

TEST_P(SevenPoints, NoMotionPutsPointsBehindACamera) {
  // Whatever is kept, each point's line runs from the epipole with one sign.
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::size_t kept = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Views views(1);
    for (auto& point : views.samples.points) {
      for (auto& column : point) std::generate(column.begin(), column.end(), [&] { return unit(engine); });
    }
    SevenPointPencils pencils;
    GetParam()->solve(views.samples, pencils);
    for (std::size_t lane = 0; lane < kSevenPointLanes; ++lane) {
      for (std::size_t k = 0; k < 3; ++k) {
        if ((pencils.kept[lane] >> k & 1U) == 0) continue;
        ++kept;
        const Matrix f = matrix(views, pencils, lane, k);
        const Eigen::Vector3d epipole = Eigen::JacobiSVD<Matrix>(f, Eigen::ComputeFullU).matrixU().col(2);
        int ahead = 0;
        for (std::size_t i = 0; i < 7; ++i) ahead += epipole.cross(views.at(1, i, lane)).dot(f * views.at(0, i, lane)) > 0 ? 1 : 0;
        EXPECT_TRUE(ahead == 0 || ahead == 7) << ahead;
      }
    }
  }
  EXPECT_GT(kept, 100U);
  EXPECT_LT(kept, 3U * 200 * kSevenPointLanes / 4);
}

INSTANTIATE_TEST_SUITE_P(Every, SevenPoints, testing::ValuesIn(cpu::available_seven_point_kernels()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace swarmfit::kernels
