// What line2d and plane share: a unit normal in D dimensions and an offset, normal . x + offset = 0.
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Dense>

#include "host/models/model_space.hpp"
#include "host/models/sphere_maps.hpp"

namespace swarmfit::models {

template <int D>
class Hyperplane : public ModelSpace {
 public:
  using Vector = Eigen::Matrix<double, D, 1>;

  explicit Hyperplane(const std::optional<DirectionPrior>& prior) {
    if (!prior) return;
    axis_ = prior->axis.template head<D>().normalized();
    max_angle_ = prior->max_angle;
  }

  int minimal_sample() const noexcept override { return D; }
  int least_rank() const noexcept override { return D - 1; }
  int parameter_count() const noexcept override { return D + 1; }
  int freedom() const noexcept override { return D; }
  int free_normal() const noexcept override { return max_angle_ ? 0 : D; }

  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    const Vector origin = points.template point<D>(sample[0]);
    Vector normal;
    if constexpr (D == 2) {
      const Vector along = points.template point<2>(sample[1]) - origin;
      normal = Vector(-along.y(), along.x());
    } else {
      const Vector a = points.template point<3>(sample[1]) - origin;
      const Vector b = points.template point<3>(sample[2]) - origin;
      normal = a.cross(b);
      // The sine of the angle between the sides: below this the sample is a line for all that float coordinates can tell.
      if (normal.squaredNorm() <= 1e-8 * a.squaredNorm() * b.squaredNorm()) return false;
    }
    const double length = normal.norm();
    if (!(length > 1e-14) || !std::isfinite(length)) return false;
    theta.resize(D + 1);
    theta.template head<D>() = normal / length;
    theta[D] = -theta.template head<D>().dot(origin);
    return admit(theta);
  }

  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    const Vector n = from.template head<D>();
    Vector m = to.template head<D>();
    double offset = to[D];
    if (n.dot(m) < 0) {  // n and -n are one plane
      m = -m;
      offset = -offset;
    }
    velocity.template head<D>() = way_between(n, m);
    velocity[D] = offset - from[D];
  }

  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    // Random factors a dimension leave the tangent space; follow() brings the velocity back into it.
    Vector n = theta.template head<D>(), v = velocity.template head<D>();
    follow(n, v);
    theta.template head<D>() = n;
    velocity.template head<D>() = v;
    theta[D] += velocity[D];
  }

  double distance(const Position& a, const Position& b) const override {
    Position v(D + 1);
    difference(a, b, v);
    return v.norm();
  }

  bool refine(const WorkingPoints& points, const Weighted& support, Position& theta) const override {
    if (support.index.size() < static_cast<std::size_t>(D)) return false;
    return refine(moments(points, support), theta);
  }

  Covariance unit_covariance(const WorkingPoints& points, const Weighted& support, const Position& theta) const override {
    return covariance(moments(points, support), theta);
  }

  bool closed_form() const noexcept override { return true; }

  bool refine_by_moments(const kernels::Moments& all, const Frame& frame, Position& theta) const override {
    return refine(moments(all, frame), theta);
  }

  Covariance covariance_by_moments(const kernels::Moments& all, const Frame& frame, const Position& theta) const override {
    return covariance(moments(all, frame), theta);
  }

  Position to_data(const Position& theta, const Frame& frame) const override {
    Position parameters = theta;
    parameters[D] = theta[D] * frame.scale;
    for (int d = 0; d < D; ++d) parameters[D] -= theta[d] * frame.centre[static_cast<std::size_t>(d)];
    return parameters;
  }

  Position from_data(const Position& parameters, const Frame& frame) const override {
    Position theta = parameters;
    for (int d = 0; d < D; ++d) theta[D] += parameters[d] * frame.centre[static_cast<std::size_t>(d)];
    theta[D] /= frame.scale;
    return theta;
  }

  Covariance covariance_to_data(const Covariance& covariance, const Position&, const Frame& frame) const override {
    Eigen::Matrix<double, D + 1, D + 1> jacobian = Eigen::Matrix<double, D + 1, D + 1>::Identity();
    jacobian(D, D) = frame.scale;
    for (int d = 0; d < D; ++d) jacobian(D, d) = -frame.centre[static_cast<std::size_t>(d)];
    return jacobian * covariance * jacobian.transpose();
  }

  bool admit(Position& theta) const override {
    if (!theta.allFinite()) return false;
    if (!max_angle_) return true;
    Vector n = theta.template head<D>();
    double cosine = n.dot(axis_);
    if (cosine < 0) {
      theta = -theta;
      n = -n;
      cosine = -cosine;
    }
    if (cosine >= std::cos(*max_angle_)) return true;
    // Back to the rim of the cone, keeping the plane through its foot point nearest to the centre of the data.
    const Vector foot = -theta[D] * n;
    Vector across = n - cosine * axis_;
    const double length = across.norm();
    if (!(length > 1e-12)) return false;
    theta.template head<D>() = (std::cos(*max_angle_) * axis_ + std::sin(*max_angle_) * across / length).normalized();
    theta[D] = -theta.template head<D>().dot(foot);
    return true;
  }

 private:
  /// In the working frame; the scatter is about the mean and divided by the total weight.
  struct Moments {
    double total = 0;
    Vector mean = Vector::Zero();
    Eigen::Matrix<double, D, D> scatter = Eigen::Matrix<double, D, D>::Zero();
  };

  static Moments moments(const WorkingPoints& points, const Weighted& support) {
    Moments m;
    points.template accumulate<D>(support.index, support.weight, m.total, m.mean, m.scatter);
    if (!(m.total > 0)) return m;
    m.mean /= m.total;
    m.scatter = m.scatter / m.total - m.mean * m.mean.transpose();
    return m;
  }

  static Moments moments(const kernels::Moments& all, const Frame& frame) {
    Moments m;
    m.total = all.weight;
    if (!(m.total > 0)) return m;
    for (std::size_t d = 0; d < D; ++d) {
      m.mean[static_cast<int>(d)] = (all.mean[d] - frame.centre[d]) / frame.scale;
      for (std::size_t e = 0; e < D; ++e) {
        m.scatter(static_cast<int>(d), static_cast<int>(e)) = all.scatter[d][e] / (m.total * frame.scale * frame.scale);
      }
    }
    return m;
  }

  bool refine(const Moments& m, Position& theta) const {
    if (!(m.total > 0)) return false;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> solver;
    if constexpr (D == 2) {
      solver.computeDirect(m.scatter);
    } else {
      solver.compute(m.scatter);
    }
    if (solver.info() != Eigen::Success) return false;
    // The second smallest spread tells a plane from a line of points, a line from a single point.
    if (!(solver.eigenvalues()[1] > 1e-12)) return false;
    Vector normal = solver.eigenvectors().col(0);
    if (normal.dot(theta.template head<D>()) < 0) normal = -normal;
    theta.template head<D>() = normal;
    theta[D] = -normal.dot(m.mean);
    return admit(theta);
  }

  /// Of a symmetric matrix, which along the normal is singular.
  static Eigen::Matrix<double, D, D> pseudo_inverse(const Eigen::Matrix<double, D, D>& information) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> parts(information);
    const double least = D * std::numeric_limits<double>::epsilon() * parts.eigenvalues()[D - 1];
    Eigen::Matrix<double, D, 1> inverse;
    for (int d = 0; d < D; ++d) inverse[d] = parts.eigenvalues()[d] > least ? 1 / parts.eigenvalues()[d] : 0.0;
    return parts.eigenvectors() * inverse.asDiagonal() * parts.eigenvectors().transpose();
  }

  static Eigen::Matrix<double, D + 1, D + 1> covariance(const Moments& m, const Position& theta) {
    Eigen::Matrix<double, D + 1, D + 1> covariance = Eigen::Matrix<double, D + 1, D + 1>::Zero();
    if (!(m.total > 0)) return covariance;
    // Residual n.x + o. With n moving in its tangent space T, the Jacobian row is [x^T T, 1]; its information is the scatter about the
    // mean for the direction and the total weight for the offset at the mean.
    const Vector n = theta.template head<D>();
    const Eigen::Matrix<double, D, D> project = Eigen::Matrix<double, D, D>::Identity() - n * n.transpose();
    const Eigen::Matrix<double, D, D> information = project * m.scatter * project * m.total;
    const Eigen::Matrix<double, D, D> direction = pseudo_inverse(information);
    covariance.topLeftCorner(D, D) = direction;
    covariance.block(0, D, D, 1) = -direction * m.mean;
    covariance.block(D, 0, 1, D) = covariance.block(0, D, D, 1).transpose();
    covariance(D, D) = m.mean.dot(direction * m.mean) + 1.0 / m.total;
    return covariance;
  }

  Vector axis_ = Vector::Zero();
  std::optional<double> max_angle_;
};

}  // namespace swarmfit::models
