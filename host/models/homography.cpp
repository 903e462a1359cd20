#include "host/models/projective.hpp"

namespace swarmfit::models {
namespace {

/// Twice the signed area of a triangle.
double turn(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// The matrix that takes the four corners of the projective basis to these points, whatever the scale; false where three are collinear.
bool from_basis(const Eigen::Matrix<double, 3, 4>& p, Eigen::Matrix3d& a) {
  const Eigen::Matrix3d corners = p.leftCols<3>();
  const double area = std::abs(corners.determinant());
  const double size = (p.rowwise().maxCoeff() - p.rowwise().minCoeff()).squaredNorm();
  if (!(area > 1e-3 * size)) return false;
  const Eigen::Vector3d share = corners.inverse() * p.col(3);
  if (!(share.cwiseAbs().minCoeff() > 1e-3)) return false;
  a = corners * share.asDiagonal();
  return true;
}

class Homography final : public Projective {
 public:
  Homography() : Projective(kernels::PairResidual::homography) {}

  ModelType type() const noexcept override { return ModelType::homography; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::homography; }
  int minimal_sample() const noexcept override { return 4; }
  int freedom() const noexcept override { return 8; }

  /// Four correspondences, each image moved to its sample's own centre and size first (Hartley), so that the solution is sound.
  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    Eigen::Matrix<double, 3, 4> a, b;
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector4d p = points.point<4>(sample[static_cast<std::size_t>(i)]);
      a.col(i) = first(p);
      b.col(i) = second(p);
    }
    if (!same_turns(a, b)) return false;
    Eigen::Matrix3d ta, tb, basis_a, basis_b;
    if (!normalise(a, ta) || !normalise(b, tb) || !from_basis(a, basis_a) || !from_basis(b, basis_b)) return false;
    const Matrix m = tb.inverse() * (basis_b * basis_a.inverse()) * ta;
    theta = position(m);
    return admit(theta);
  }

  Position to_data(const Position& theta, const Frame& frame) const override {
    return position(to_image(frame, 1) * matrix(theta) * from_image(frame, 0));
  }
  Position from_data(const Position& parameters, const Frame& frame) const override {
    return position(from_image(frame, 1) * matrix(parameters) * to_image(frame, 0));
  }

  bool admit(Position& theta) const override {
    if (!theta.allFinite()) return false;
    // Orientation is kept and nothing is flattened; the sign is that of points in front of both cameras.
    const double determinant = matrix(theta).determinant();
    if (!(std::abs(determinant) > 1e-7)) return false;
    if (theta[8] < 0) theta = -theta;
    return true;
  }

  /// Sampson's error: c(x, H) = (u - x', v - y') with (u, v) = H x, divided by the root of its covariance under unit noise in all columns.
  bool residual(const WorkingPoints& points, std::uint32_t index, const Position& theta, std::span<double> components) const override {
    const Eigen::Vector4d p = points.point<4>(index);
    const Eigen::Map<const Matrix> m(theta.data());
    const Eigen::Vector3d x = first(p);
    const double depth = m.row(2).dot(x);
    if (!(std::abs(depth) > 1e-12)) return false;
    const double scale = 1 / depth, u = scale * m.row(0).dot(x), v = scale * m.row(1).dot(x);
    // Of the image by the point, along * along^T + I; and its root, lower triangular.
    const double a = scale * (m(0, 0) - u * m(2, 0)), b = scale * (m(0, 1) - u * m(2, 1));
    const double c = scale * (m(1, 0) - v * m(2, 0)), d = scale * (m(1, 1) - v * m(2, 1));
    const double first_root = std::sqrt(1 + a * a + b * b), mixed = (a * c + b * d) / first_root;
    components[0] = (u - p[2]) / first_root;
    components[1] = (v - p[3] - mixed * components[0]) / std::sqrt(1 + c * c + d * d - mixed * mixed);
    return std::isfinite(components[0]) && std::isfinite(components[1]);
  }

 protected:
  /// The tangent space of the unit sphere: what the Householder reflection that takes theta to an axis leaves.
  Basis basis(const Position& theta) const override {
    Vector9 u = theta;
    u[0] += theta[0] < 0 ? -1 : 1;
    const Eigen::Matrix<double, 9, 9> reflection = Eigen::Matrix<double, 9, 9>::Identity() - u * u.transpose() * (2 / u.squaredNorm());
    return reflection.rightCols<8>();
  }
  Position retract(const Position& theta, const Position& step) const override {
    Position moved = theta + basis(theta) * step;
    moved.normalize();
    return moved;
  }

 private:
  /// A view of a plane from its one side never turns a triangle over: of the four triangles all or none may change sign together.
  static bool same_turns(const Eigen::Matrix<double, 3, 4>& a, const Eigen::Matrix<double, 3, 4>& b) {
    static constexpr int kTriangles[4][3] = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
    int same = 0;
    for (const auto& t : kTriangles) same += turn(a.col(t[0]), a.col(t[1]), a.col(t[2])) * turn(b.col(t[0]), b.col(t[1]), b.col(t[2])) > 0;
    return same == 0 || same == 4;
  }
};

}  // namespace

std::unique_ptr<ModelSpace> make_homography_space(const std::optional<DirectionPrior>&) { return std::make_unique<Homography>(); }

}  // namespace swarmfit::models
