// Least squares on correspondences, on every instruction set, against sums made one correspondence at a time.
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "kernels/cpu/pair_kernels.hpp"

namespace swarmfit::kernels {
namespace {

using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, 9>;

struct Pairs {
  std::vector<double> rows, weights;

  Pairs(std::size_t count, unsigned seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      for (int c = 0; c < 4; ++c) rows.push_back(unit(engine));
      weights.push_back(1.5 + unit(engine));
    }
  }
  WeightedPairs view() const { return {rows, weights}; }
};

Matrix some_matrix(unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> unit(-0.3, 0.3);
  Matrix m = Matrix::Identity();
  for (int k = 0; k < 9; ++k) m.data()[k] += unit(engine);
  return m;
}

struct Linear {
  Eigen::VectorXd residual;
  Jacobian by_entry;
};

/// (u, v) - (x', y') by the inverse of the root of its covariance, which is held while the matrix moves.
Linear homography(const Matrix& h, const double* row) {
  const Eigen::Vector3d x(row[0], row[1], 1), there = h * x;
  const Eigen::Vector2d image = there.hnormalized();
  Eigen::Matrix<double, 2, 3> by_there;
  by_there << 1 / there[2], 0, -image[0] / there[2], 0, 1 / there[2], -image[1] / there[2];
  const Eigen::Matrix2d by_point = (by_there * h).leftCols<2>();
  const Eigen::Matrix2d covariance = by_point * by_point.transpose() + Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d whitening = Eigen::Matrix2d(covariance.llt().matrixL()).inverse();
  Linear at{whitening * (image - Eigen::Vector2d(row[2], row[3])), Jacobian(2, 9)};
  for (int k = 0; k < 9; ++k) at.by_entry.col(k) = whitening * by_there.col(k / 3) * x[k % 3];
  return at;
}

double epipolar(const Matrix& f, const double* row) {
  const Eigen::Vector3d x(row[0], row[1], 1), there(row[2], row[3], 1);
  return there.dot(f * x) / std::sqrt((f * x).head<2>().squaredNorm() + (f.transpose() * there).head<2>().squaredNorm());
}

Linear fundamental(const Matrix& f, const double* row) {
  constexpr double kStep = 1e-6;
  Linear at{Eigen::VectorXd::Constant(1, epipolar(f, row)), Jacobian(1, 9)};
  for (int k = 0; k < 9; ++k) {
    Matrix ahead = f, behind = f;
    ahead.data()[k] += kStep;
    behind.data()[k] -= kStep;
    at.by_entry(0, k) = (epipolar(ahead, row) - epipolar(behind, row)) / (2 * kStep);
  }
  return at;
}

class Kernels : public testing::TestWithParam<const cpu::PairKernels*> {
 protected:
  void expect_sums(PairResidual residual, const Matrix& m, const Pairs& pairs, double tolerance) const {
    PairSums found;
    GetParam()->add_sums(residual, m.data(), pairs.view(), found);
    Eigen::Matrix<double, 9, 9> information = Eigen::Matrix<double, 9, 9>::Zero();
    Vector9 gradient = Vector9::Zero();
    double squares = 0;
    for (std::size_t i = 0; i < pairs.weights.size(); ++i) {
      const double* const row = pairs.rows.data() + 4 * i;
      const Linear at = residual == PairResidual::homography ? homography(m, row) : fundamental(m, row);
      information += pairs.weights[i] * at.by_entry.transpose() * at.by_entry;
      gradient += pairs.weights[i] * at.by_entry.transpose() * at.residual;
      squares += pairs.weights[i] * at.residual.squaredNorm();
    }
    EXPECT_EQ(found.used, pairs.weights.size());
    EXPECT_NEAR(found.squares, squares, 1e-12 * (1 + squares));
    EXPECT_NEAR(GetParam()->squares(residual, m.data(), pairs.view()), squares, 1e-12 * (1 + squares));
    const double scale = 1 + information.norm();
    EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 9>>(found.information.data()) - information).norm(), tolerance * scale);
    EXPECT_LT((Eigen::Map<const Vector9>(found.gradient.data()) - gradient).norm(), tolerance * scale);
  }
};

TEST_P(Kernels, SumsAreThoseOfOneCorrespondenceAfterTheOther) {
  for (const std::size_t count : {0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 100}) {
    SCOPED_TRACE(count);
    const auto seed = static_cast<unsigned>(count) + 1;
    expect_sums(PairResidual::homography, some_matrix(seed), Pairs(count, seed), 1e-12);
    expect_sums(PairResidual::fundamental, some_matrix(seed), Pairs(count, seed), 1e-7);
  }
}

TEST_P(Kernels, SumsAreAddedTo) {
  for (const PairResidual residual : {PairResidual::homography, PairResidual::fundamental}) {
    const Pairs pairs(13, 5);
    const Matrix m = some_matrix(5);
    PairSums once, twice;
    GetParam()->add_sums(residual, m.data(), pairs.view(), once);
    GetParam()->add_sums(residual, m.data(), pairs.view(), twice);
    GetParam()->add_sums(residual, m.data(), pairs.view(), twice);
    EXPECT_EQ(twice.used, 26U);
    EXPECT_DOUBLE_EQ(twice.squares, 2 * once.squares);
    for (std::size_t k = 0; k < 81; ++k) EXPECT_DOUBLE_EQ(twice.information[k], 2 * once.information[k]);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_DOUBLE_EQ(twice.gradient[k], 2 * once.gradient[k]);
  }
}

TEST_P(Kernels, WhereTheResidualIsNotDefinedACorrespondenceHasNoSay) {
  // The origin is sent to infinity by the one, and is both epipoles of the other.
  Matrix to_infinity, epipoles_at_origin;
  to_infinity << 1, 0.2, 0, 0.1, 1, 0.3, 1, 0.5, 0;
  epipoles_at_origin << 0.4, 1, 0, -1, 0.3, 0, 0, 0, 0;
  for (const auto& [residual, m] :
       {std::pair(PairResidual::homography, to_infinity), std::pair(PairResidual::fundamental, epipoles_at_origin)}) {
    for (const std::size_t count : {1, 3, 8, 11}) {
      for (const std::size_t odd : {std::size_t{0}, count / 2, count - 1}) {
        SCOPED_TRACE(testing::Message() << count << ", " << odd);
        Pairs with(count, 9), without = with;
        std::fill_n(with.rows.begin() + static_cast<std::ptrdiff_t>(4 * odd), 4, 0.0);
        without.rows.erase(without.rows.begin() + static_cast<std::ptrdiff_t>(4 * odd),
                           without.rows.begin() + static_cast<std::ptrdiff_t>(4 * odd + 4));
        without.weights.erase(without.weights.begin() + static_cast<std::ptrdiff_t>(odd));
        PairSums found, exact;
        GetParam()->add_sums(residual, m.data(), with.view(), found);
        GetParam()->add_sums(residual, m.data(), without.view(), exact);
        EXPECT_EQ(found.used, count - 1);
        EXPECT_NEAR(found.squares, exact.squares, 1e-12 * (1 + exact.squares));
        for (std::size_t k = 0; k < 81; ++k) EXPECT_NEAR(found.information[k], exact.information[k], 1e-9 * (1 + exact.information[0]));
        EXPECT_TRUE(std::isinf(GetParam()->squares(residual, m.data(), with.view())));
        EXPECT_TRUE(std::isfinite(GetParam()->squares(residual, m.data(), without.view())));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, Kernels, testing::ValuesIn(cpu::available_pair_kernels()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace swarmfit::kernels
