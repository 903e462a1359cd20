// What circle2d and sphere share: a centre in D dimensions and a radius.
#pragma once

#include <cmath>

#include "host/models/curved_space.hpp"

namespace swarmfit::models {

template <int D>
class Round : public Linearised<Round<D>, D + 1> {
 public:
  using Vector = Eigen::Matrix<double, D, 1>;
  using Basis = CurvedSpace::Basis;
  using Linear = typename Linearised<Round<D>, D + 1>::Linear;

  int minimal_sample() const noexcept override { return D + 1; }
  int least_rank() const noexcept override { return D; }
  int parameter_count() const noexcept override { return D + 1; }
  int freedom() const noexcept override { return D + 1; }

  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    // |x|^2 - 2 c.x = const for all: differences to the first point are linear in the centre.
    const Vector origin = points.template point<D>(sample[0]);
    Eigen::Matrix<double, D, D> sides;
    Vector half;
    double size = 1;
    for (int i = 0; i < D; ++i) {
      const Vector side = points.template point<D>(sample[static_cast<std::size_t>(i) + 1]) - origin;
      sides.row(i) = side;
      half[i] = 0.5 * side.squaredNorm();
      size *= side.norm();
    }
    // The volume the sides span against that of a box: collinear or coplanar samples have none.
    if (!(std::abs(sides.determinant()) > 1e-4 * size)) return false;
    const Vector offset = sides.inverse() * half;
    theta.resize(D + 1);
    theta.template head<D>() = origin + offset;
    theta[D] = offset.norm();
    return admit(theta);
  }

  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override { velocity = to - from; }
  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override { theta += velocity; }

  Position to_data(const Position& theta, const Frame& frame) const override {
    Position parameters = theta * frame.scale;
    for (int d = 0; d < D; ++d) parameters[d] += frame.centre[static_cast<std::size_t>(d)];
    return parameters;
  }
  Position from_data(const Position& parameters, const Frame& frame) const override {
    Position theta = parameters;
    for (int d = 0; d < D; ++d) theta[d] -= frame.centre[static_cast<std::size_t>(d)];
    return theta / frame.scale;
  }

  bool admit(Position& theta) const override { return theta.allFinite() && theta[D] > 0 && theta[D] < kLargest; }

  bool linearise(const double* row, const Position& theta, Linear& at) const {
    const Vector arm = Eigen::Map<const Vector>(row) - theta.template head<D>();
    const double length = arm.norm();
    if (!(length > 0)) return false;
    at.residual = length - theta[D];
    at.by_parameter.template topLeftCorner<1, D>() = -arm.transpose() / length;
    at.by_parameter(0, D) = -1;
    return true;
  }

 protected:
  Basis basis(const Position&) const override { return Basis::Identity(D + 1, D + 1); }
  Position retract(const Position& theta, const Position& step) const override { return theta + step; }

 private:
  /// In units of the cloud's own spread: a rounder shape than this is flat for all that the data can tell.
  static constexpr double kLargest = 10;
};

}  // namespace swarmfit::models
