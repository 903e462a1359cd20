// What homography and fundamental share: a 3x3 matrix up to scale, kept as a unit vector of 9, M and -M being one model; and least squares on
// vectors of correspondences (kernels/pair_sums.hpp).
#pragma once

#include <cmath>

#include "host/models/curved_space.hpp"
#include "host/models/sphere_maps.hpp"
#include "kernels/pair_sums.hpp"

namespace swarmfit::models {

class Projective : public CurvedSpace {
 public:
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using Vector9 = Eigen::Matrix<double, 9, 1>;

  explicit Projective(kernels::PairResidual residual) : residual_(residual) {}

  int least_rank() const noexcept override { return 2; }
  bool costly_samples() const noexcept override { return true; }
  int parameter_count() const noexcept override { return 9; }

  /// Along the great circle of the unit sphere in 9 dimensions, to whichever of M and -M is nearer.
  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    const Vector9 here = from, there = to;
    velocity = here.dot(there) < 0 ? way_between<Vector9>(here, -there) : way_between(here, there);
  }

  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    Vector9 m = theta, v = velocity;
    follow(m, v);
    theta = m;
    velocity = v;
  }

  int residual_components() const noexcept override { return residual_ == kernels::PairResidual::homography ? 2 : 1; }

 protected:
  Equations equations(const SupportRows& support, const Position& theta) const override {
    kernels::PairSums sums;
    support.in_runs([&](std::span<const double> rows, std::span<const double> weights) {
      kernels::add_pair_sums(residual_, theta.data(), {rows, weights}, sums);
    });
    const Basis chart = basis(theta);
    return {chart.transpose() * Eigen::Map<const Eigen::Matrix<double, 9, 9>>(sums.information.data()) * chart,
            chart.transpose() * Eigen::Map<const Vector9>(sums.gradient.data()), sums.squares, sums.used};
  }
  double squares(const SupportRows& support, const Position& theta) const override {
    double sum = 0;
    support.in_runs([&](std::span<const double> rows, std::span<const double> weights) {
      sum += kernels::pair_squares(residual_, theta.data(), {rows, weights});
    });
    return sum;
  }

  static Matrix matrix(const Position& theta) { return Eigen::Map<const Matrix>(theta.data()); }
  static Position position(const Matrix& m) {
    Position theta = Eigen::Map<const Vector9>(m.data());
    theta.normalize();
    return theta;
  }
  /// x_data = scale x + centre of the first (columns 0, 1) or second (2, 3) image.
  static Matrix to_image(const Frame& frame, std::size_t image) {
    Matrix t = Matrix::Identity();
    t(0, 0) = t(1, 1) = frame.scale;
    t(0, 2) = frame.centre[2 * image];
    t(1, 2) = frame.centre[2 * image + 1];
    return t;
  }
  static Matrix from_image(const Frame& frame, std::size_t image) {
    Matrix t = Matrix::Identity();
    t(0, 0) = t(1, 1) = 1 / frame.scale;
    t(0, 2) = -frame.centre[2 * image] / frame.scale;
    t(1, 2) = -frame.centre[2 * image + 1] / frame.scale;
    return t;
  }
  /// Moves a sample of one image to its own centre and size (Hartley); `t` does that to a point. False where it has no size.
  template <int N>
  static bool normalise(Eigen::Matrix<double, 3, N>& p, Eigen::Matrix3d& t) {
    const Eigen::Vector3d mean = p.rowwise().mean();
    const double size = std::sqrt((p.colwise() - mean).colwise().squaredNorm().mean());
    if (!(size > 1e-9)) return false;
    t << 1 / size, 0, -mean[0] / size, 0, 1 / size, -mean[1] / size, 0, 0, 1;
    p.template topRows<2>() = (p.template topRows<2>().colwise() - mean.template head<2>()) / size;
    return true;
  }
  static Eigen::Vector3d first(const Eigen::Vector4d& p) { return {p[0], p[1], 1}; }
  static Eigen::Vector3d second(const Eigen::Vector4d& p) { return {p[2], p[3], 1}; }

 private:
  kernels::PairResidual residual_;
};

}  // namespace swarmfit::models
