// What homography and fundamental share: a 3x3 matrix up to scale, kept as a unit vector of 9, M and -M being one model.
#pragma once

#include <cmath>

#include "host/models/curved_space.hpp"

namespace swarmfit::models {

class Projective : public CurvedSpace {
 public:
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using Vector9 = Eigen::Matrix<double, 9, 1>;

  int least_rank() const noexcept override { return 2; }
  int parameter_count() const noexcept override { return 9; }

  /// Along the great circle of the unit sphere in 9 dimensions, to whichever of M and -M is nearer.
  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    const double cosine = from.dot(to);
    const Vector9 target = cosine < 0 ? Vector9(-to) : Vector9(to);
    const Vector9 across = target - std::abs(cosine) * from;
    const double sine = across.norm();
    const double angle = std::atan2(sine, std::abs(cosine));
    velocity = sine > 1e-300 ? Vector9(across * (angle / sine)) : Vector9(Vector9::Zero());
  }

  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    Vector9 v = velocity - theta.dot(velocity) * theta;
    double angle = v.norm();
    constexpr double kQuarterTurn = 1.5707963267948966;
    if (angle > kQuarterTurn) {
      v *= kQuarterTurn / angle;
      angle = kQuarterTurn;
    }
    if (!(angle > 1e-300)) {
      velocity.setZero();
      return;
    }
    const Vector9 direction = v / angle, before = theta;
    theta = (std::cos(angle) * before + std::sin(angle) * direction).normalized();
    velocity = angle * (std::cos(angle) * direction - std::sin(angle) * before);  // carried along the great circle
  }

 protected:
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
  static Eigen::Vector3d first(const Eigen::Vector4d& p) { return {p[0], p[1], 1}; }
  static Eigen::Vector3d second(const Eigen::Vector4d& p) { return {p[2], p[3], 1}; }
};

}  // namespace swarmfit::models
