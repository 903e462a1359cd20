#include <cmath>

#include "host/models/curved_space.hpp"
#include "host/models/sphere_maps.hpp"

namespace swarmfit::models {
namespace {

/// In units of the cloud's own spread: a rounder shape than this is flat for all that the data can tell.
constexpr double kLargest = 2;
/// Sine of the least angle between two normals whose cross product is taken for the axis.
constexpr double kLeastTurn = 0.1;

/// Position: a point of the axis (the one nearest the origin), its direction, the radius.
class Cylinder final : public Linearised<Cylinder, 7> {
 public:
  using Vector = Eigen::Vector3d;

  explicit Cylinder(const std::optional<DirectionPrior>& prior) {
    if (!prior) return;
    direction_ = prior->axis.normalized();
    least_cosine_ = std::cos(prior->max_angle);
  }

  ModelType type() const noexcept override { return ModelType::cylinder; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::cylinder; }
  int minimal_sample() const noexcept override { return 2; }
  int least_rank() const noexcept override { return 3; }
  bool needs_normals() const noexcept override { return true; }
  int parameter_count() const noexcept override { return 7; }
  int freedom() const noexcept override { return 5; }

  /// Two oriented points: the axis is perpendicular to both normals and meets both normal lines.
  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    const Vector p = points.point<3>(sample[0]), q = points.point<3>(sample[1]);
    const Vector n = points.normal(sample[0]), m = points.normal(sample[1]);
    Vector axis = n.cross(m);
    const double turn = axis.norm();
    if (!(turn > kLeastTurn)) return false;
    axis /= turn;
    // Across the axis: p + s n = q + t m in the least-squares sense of the plane both normals span.
    const Vector between = q - p;
    const double cosine = n.dot(m), a = n.dot(between), b = m.dot(between), determinant = 1 - cosine * cosine;
    const double s = (a - cosine * b) / determinant, t = (cosine * a - b) / determinant;
    // Both points lie on the outside, or both on the inside, and equally far.
    if (!(s * t > 0) || std::abs(std::abs(s) - std::abs(t)) > 0.25 * (std::abs(s) + std::abs(t))) return false;
    theta.resize(7);
    theta.head<3>() = p + s * n;
    theta.segment<3>(3) = axis;
    theta[6] = 0.5 * (std::abs(s) + std::abs(t));
    return admit(theta);
  }

  void difference(const Position& from, const Position& to, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    const Vector a = from.segment<3>(3);
    const Vector b = a.dot(to.segment<3>(3)) < 0 ? Vector(-to.segment<3>(3)) : Vector(to.segment<3>(3));
    velocity.head<3>() = to.head<3>() - from.head<3>();
    velocity.segment<3>(3) = way_between(a, b);
    velocity[6] = to[6] - from[6];
  }

  void move(Position& theta, Eigen::Ref<Eigen::VectorXd> velocity) const override {
    Vector axis = theta.segment<3>(3), v = velocity.segment<3>(3);
    follow(axis, v);
    theta.head<3>() += velocity.head<3>();
    theta.segment<3>(3) = axis;
    theta[6] += velocity[6];
    velocity.segment<3>(3) = v;
  }

  Vector outward(const Position& theta, const Vector& point) const override {
    const Vector axis = theta.segment<3>(3), arm = point - theta.head<3>();
    return arm - axis.dot(arm) * axis;
  }

  Position to_data(const Position& theta, const Frame& frame) const override {
    Position parameters = theta;
    parameters.head<3>() *= frame.scale;
    for (int d = 0; d < 3; ++d) parameters[d] += frame.centre[static_cast<std::size_t>(d)];
    parameters[6] *= frame.scale;
    return parameters;
  }
  Position from_data(const Position& parameters, const Frame& frame) const override {
    Position theta = parameters;
    for (int d = 0; d < 3; ++d) theta[d] -= frame.centre[static_cast<std::size_t>(d)];
    theta.head<3>() /= frame.scale;
    theta[6] /= frame.scale;
    return theta;
  }

  bool admit(Position& theta) const override {
    if (!theta.allFinite() || !(theta[6] > 0 && theta[6] < kLargest)) return false;
    const Vector axis = theta.segment<3>(3);
    if (direction_ && std::abs(axis.dot(*direction_)) < least_cosine_) return false;
    theta.head<3>() -= axis.dot(theta.head<3>()) * axis;
    return true;
  }

  bool linearise(const double* row, const Position& theta, Linear& at) const {
    const Vector axis = theta.segment<3>(3), arm = Eigen::Map<const Vector>(row) - theta.head<3>();
    const double along = axis.dot(arm);
    const Vector across = arm - along * axis;
    const double length = across.norm();
    if (!(length > 0)) return false;
    at.residual = length - theta[6];
    const Vector outward = across / length;
    at.by_parameter.block<1, 3>(0, 0) = -outward.transpose();
    at.by_parameter.block<1, 3>(0, 3) = -along * outward.transpose();
    at.by_parameter(0, 6) = -1;
    return true;
  }

 protected:
  /// The point moves across the axis, the axis in its tangent plane.
  Basis basis(const Position& theta) const override {
    const auto [u, v] = tangents(theta);
    Basis chart = Basis::Zero(7, 5);
    chart.block<3, 1>(0, 0) = u;
    chart.block<3, 1>(0, 1) = v;
    chart.block<3, 1>(3, 2) = u;
    chart.block<3, 1>(3, 3) = v;
    chart(6, 4) = 1;
    return chart;
  }
  Position retract(const Position& theta, const Position& step) const override {
    Position moved = theta + basis(theta) * step;
    moved.segment<3>(3).normalize();
    return moved;
  }

 private:
  static std::pair<Vector, Vector> tangents(const Position& theta) {
    const Vector axis = theta.segment<3>(3);
    Eigen::Index least = 0;
    axis.cwiseAbs().minCoeff(&least);
    const Vector u = axis.cross(Vector::Unit(least)).normalized();
    return {u, axis.cross(u)};
  }

  std::optional<Vector> direction_;
  double least_cosine_ = 0;
};

}  // namespace

std::unique_ptr<ModelSpace> make_cylinder_space(const std::optional<DirectionPrior>& prior) { return std::make_unique<Cylinder>(prior); }

}  // namespace swarmfit::models
