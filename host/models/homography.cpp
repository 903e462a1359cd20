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

class Homography final : public Linearised<Homography, Projective, 2, 9> {
 public:
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

  bool linearise(const double* row, const Position& theta, Linear& at) const {
    Sampson error;
    if (!sampson(row, theta, error)) return false;
    const Eigen::RowVector3d x = first(Eigen::Vector4d(row)).transpose();
    at.residual = error.residual;
    for (int i = 0; i < 2; ++i) {
      for (Eigen::Index r = 0; r < 3; ++r) at.by_parameter.block<1, 3>(i, 3 * r) = error.by_row(r, i) * x;
    }
    return true;
  }
  bool tell_residual(const double* row, const Position& theta, Linear& at) const {
    Sampson error;
    if (!sampson(row, theta, error)) return false;
    at.residual = error.residual;
    return true;
  }

 protected:
  /// As for any kind, but that what a point adds to the information is a product of two matrices of three rows.
  Equations equations(const SupportRows& support, const Position& theta) const override {
    using Six = Eigen::Array<double, 6, 1>;  // a symmetric matrix of three rows
    Six blocks[6];
    for (Six& block : blocks) block.setZero();
    Matrix gradient = Matrix::Zero();
    Equations sum;
    SupportRows::Room room;
    for (std::size_t k = 0; k < support.size(); ++k) {
      const double* const row = support.row(k, room);
      Sampson at;
      if (!sampson(row, theta, at)) continue;
      const double w = support.weight(k), x = row[0], y = row[1];
      const Eigen::Vector3d by_one = at.by_row.col(0), by_other = at.by_row.col(1);
      Six by_row, point;
      by_row << by_one[0] * by_one[0] + by_other[0] * by_other[0], by_other[0] * by_other[1],
          by_one[0] * by_one[2] + by_other[0] * by_other[2], by_other[1] * by_other[1], by_other[1] * by_other[2],
          by_one[2] * by_one[2] + by_other[2] * by_other[2];
      point << w * x * x, w * x * y, w * x, w * y * y, w * y, w;
      for (int b = 0; b < 6; ++b) blocks[b] += by_row[b] * point;
      const Eigen::Vector3d pull = w * (at.by_row * at.residual);
      gradient += pull * Eigen::RowVector3d(x, y, 1);
      sum.squares += w * at.residual.squaredNorm();
      ++sum.used;
    }
    static constexpr int kPlace[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    Eigen::Matrix<double, 9, 9> information;
    for (int i = 0; i < 9; ++i) {
      for (int j = 0; j < 9; ++j) information(i, j) = blocks[kPlace[i / 3][j / 3]][kPlace[i % 3][j % 3]];
    }
    const Basis chart = basis(theta);
    sum.information = chart.transpose() * information * chart;
    sum.gradient = chart.transpose() * Eigen::Map<const Vector9>(gradient.data());
    return sum;
  }

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
  struct Sampson {
    Eigen::Vector2d residual;
    /// Derivative of each component by an entry of the matrix: that of its row here, times the point's coordinate (x, y, 1).
    Eigen::Matrix<double, 3, 2> by_row;
  };

  /// Sampson's error: c(x, H) = (u - x', v - y') with (u, v) = H x, divided by the root of its covariance under unit noise in all columns.
  static bool sampson(const double* row, const Position& theta, Sampson& at) {
    const Eigen::Vector4d p(row);
    const Eigen::Map<const Matrix> m(theta.data());
    const Eigen::Vector3d x = first(p);
    const double depth = m.row(2).dot(x);
    if (!(std::abs(depth) > 1e-12)) return false;
    const double scale = 1 / depth, u = scale * m.row(0).dot(x), v = scale * m.row(1).dot(x);
    // Of the image by the point, along * along^T + I; and its root, lower triangular.
    const double a = scale * (m(0, 0) - u * m(2, 0)), b = scale * (m(0, 1) - u * m(2, 1));
    const double c = scale * (m(1, 0) - v * m(2, 0)), d = scale * (m(1, 1) - v * m(2, 1));
    const double first_root = std::sqrt(1 + a * a + b * b), mixed = (a * c + b * d) / first_root;
    const double second_root = std::sqrt(1 + c * c + d * d - mixed * mixed);
    const double one = 1 / first_root, other = 1 / second_root;
    at.residual[0] = one * (u - p[2]);
    at.residual[1] = other * (v - p[3] - mixed * at.residual[0]);
    const double by_first = one * scale, by_second = other * scale, share = other * mixed * by_first;
    at.by_row.col(0) << by_first, 0, -u * by_first;
    at.by_row.col(1) << -share, by_second, u * share - v * by_second;
    return std::isfinite(at.residual[0]) && std::isfinite(at.residual[1]);
  }

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
