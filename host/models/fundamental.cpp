#include <array>

#include "host/models/projective.hpp"

namespace swarmfit::models {
namespace {

using Svd = Eigen::JacobiSVD<Eigen::Matrix3d>;

/// Real roots of c[0] + c[1] x + c[2] x^2 + c[3] x^3.
int real_roots(const std::array<double, 4>& c, std::array<double, 3>& roots) {
  const double size = std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2]), std::abs(c[3])});
  if (!(size > 0) || !std::isfinite(size)) return 0;
  if (std::abs(c[3]) < 1e-12 * size) {
    if (std::abs(c[2]) < 1e-12 * size) {
      if (std::abs(c[1]) < 1e-12 * size) return 0;
      roots[0] = -c[0] / c[1];
      return 1;
    }
    const double inside = c[1] * c[1] - 4 * c[2] * c[0];
    if (inside < 0) return 0;
    roots[0] = (-c[1] + std::sqrt(inside)) / (2 * c[2]);
    roots[1] = (-c[1] - std::sqrt(inside)) / (2 * c[2]);
    return 2;
  }
  const double a = c[2] / c[3], b = c[1] / c[3], d = c[0] / c[3];
  const double q = (a * a - 3 * b) / 9, r = (2 * a * a * a - 9 * a * b + 27 * d) / 54;
  if (r * r < q * q * q) {
    const double angle = std::acos(std::clamp(r / std::sqrt(q * q * q), -1.0, 1.0));
    for (int k = 0; k < 3; ++k) {
      roots[static_cast<std::size_t>(k)] = -2 * std::sqrt(q) * std::cos((angle + 2 * k * 3.14159265358979323846) / 3) - a / 3;
    }
    return 3;
  }
  const double u = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(std::max(0.0, r * r - q * q * q))), r);
  roots[0] = u + (u != 0 ? q / u : 0) - a / 3;
  return 1;
}

class Fundamental final : public Linearised<Fundamental, Projective, 1, 9> {
 public:
  ModelType type() const noexcept override { return ModelType::fundamental; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::fundamental; }
  int minimal_sample() const noexcept override { return 7; }
  int freedom() const noexcept override { return 7; }

  /// Seven correspondences leave a pencil of matrices, of which up to three have rank 2. Those that put points behind a camera are left
  /// out; where several remain, the sample itself, taken as a number, decides.
  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    Eigen::Matrix<double, 3, 7> a, b;
    for (int i = 0; i < 7; ++i) {
      const Eigen::Vector4d p = points.point<4>(sample[static_cast<std::size_t>(i)]);
      a.col(i) = first(p);
      b.col(i) = second(p);
    }
    Eigen::Matrix3d ta, tb;
    if (!normalise(a, ta) || !normalise(b, tb)) return false;
    Eigen::Matrix3d f[2];
    if (!pencil(a, b, f)) return false;
    std::array<double, 3> roots{};
    const int count = real_roots(determinant(f[0], f[1]), roots);
    std::array<Eigen::Matrix3d, 3> candidates;
    std::size_t kept = 0;
    for (int k = 0; k < count; ++k) {
      const Eigen::Matrix3d one = f[0] + roots[static_cast<std::size_t>(k)] * f[1];
      if (oriented(one, a, b)) candidates[kept++] = one;
    }
    if (kept == 0) return false;
    std::size_t number = 0;
    for (const std::uint32_t i : sample) number = number * 31 + i;
    theta = position(tb.transpose() * candidates[number % kept] * ta);
    return admit(theta);
  }

  Position to_data(const Position& theta, const Frame& frame) const override {
    return position(from_image(frame, 1).transpose() * matrix(theta) * from_image(frame, 0));
  }
  Position from_data(const Position& parameters, const Frame& frame) const override {
    return position(to_image(frame, 1).transpose() * matrix(parameters) * to_image(frame, 0));
  }

  /// The nearest matrix of rank 2, to first order: along the gradient of the determinant, its cofactors, until that is zero. A unit
  /// matrix of rank 2 is left by a step of the swarm so little that two steps are the rule; the singular values take over where not.
  bool admit(Position& theta) const override {
    if (!theta.allFinite()) return false;
    Matrix m = matrix(theta);
    for (int step = 0; step < 4; ++step) {
      const Matrix by_entry = cofactors(m);
      const double slope = by_entry.squaredNorm(), determinant = m.row(0).dot(by_entry.row(0));
      if (!(slope > kLeastSlope)) return false;
      if (std::abs(determinant) < kNoDeterminant) {
        theta = position(m);
        return true;
      }
      m -= (determinant / slope) * by_entry;
    }
    const Svd svd(matrix(theta), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d s = svd.singularValues();
    s[2] = 0;
    theta = position(svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose());
    return true;
  }

  /// Sampson's error.
  bool linearise(const double* row, const Position& theta, Linear& at) const {
    const Eigen::Vector4d p(row);
    const Eigen::Map<const Matrix> m(theta.data());
    const Eigen::Vector3d x = first(p), y = second(p), right = m * x, left = m.transpose() * y;
    const double gradient = std::sqrt(right.head<2>().squaredNorm() + left.head<2>().squaredNorm());
    if (!(gradient > 1e-15)) return false;
    const double e = y.dot(right) / gradient;
    at.residual[0] = e;
    // d(c / g) = (dc - e dg) / g, with g dg = right.d(right) + left.d(left) over the first two entries.
    const Eigen::Vector3d r(right[0], right[1], 0), l(left[0], left[1], 0);
    const Matrix by = (y * x.transpose() - (e / gradient) * (r * x.transpose() + y * l.transpose())) / gradient;
    at.by_parameter.row(0) = Eigen::Map<const Vector9>(by.data()).transpose();
    return std::isfinite(e);
  }

 protected:
  /// Of U diag(cos a, sin a, 0) V^T by small rotations of U and V and by a: seven numbers, rank 2 throughout.
  Basis basis(const Position& theta) const override {
    const Svd svd(matrix(theta), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d& u = svd.matrixU();
    const Eigen::Matrix3d& v = svd.matrixV();
    const Eigen::Vector3d s = svd.singularValues();
    Basis chart(9, 7);
    for (int k = 0; k < 3; ++k) {
      chart.col(k) = flat(u * skew(k) * s.asDiagonal() * v.transpose());
      chart.col(3 + k) = flat(u * s.asDiagonal() * skew(k).transpose() * v.transpose());
    }
    chart.col(6) = flat(u * Eigen::Vector3d(-s[1], s[0], 0).asDiagonal() * v.transpose());
    return chart;
  }
  Position retract(const Position& theta, const Position& step) const override {
    const Svd svd(matrix(theta), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Vector3d s = svd.singularValues();
    const double angle = std::atan2(s[1], s[0]) + step[6];
    const Eigen::Matrix3d u = svd.matrixU() * rotation(step.head<3>()), v = svd.matrixV() * rotation(step.segment<3>(3));
    return position(u * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0).asDiagonal() * v.transpose());
  }

 private:
  static constexpr double kLeastSlope = 1e-18;     // square of the second singular value of a unit matrix
  static constexpr double kNoDeterminant = 1e-15;  // of a unit matrix

  static Matrix cofactors(const Matrix& m) {
    Matrix c;
    c.row(0) = m.row(1).cross(m.row(2));
    c.row(1) = m.row(2).cross(m.row(0));
    c.row(2) = m.row(0).cross(m.row(1));
    return c;
  }
  static Vector9 flat(const Matrix& m) { return Eigen::Map<const Vector9>(m.data()); }
  static Eigen::Matrix3d skew(int axis) {
    Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
    m((axis + 2) % 3, (axis + 1) % 3) = 1;
    m((axis + 1) % 3, (axis + 2) % 3) = -1;
    return m;
  }
  static Eigen::Matrix3d rotation(const Eigen::Vector3d& w) {
    const double angle = w.norm();
    return angle > 1e-300 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  }

  /// Two matrices that span the null space of the seven epipolar constraints; false where it is larger. Elimination, each equation for the
  /// unknown that weighs most in it: the samples are small and scaled, and a swarm takes a great many of them.
  static bool pencil(const Eigen::Matrix<double, 3, 7>& a, const Eigen::Matrix<double, 3, 7>& b, Eigen::Matrix3d* f) {
    constexpr int kRows = 7, kColumns = 9;
    constexpr double kLeastPivot = 1e-6;
    double m[kRows][kColumns];
    for (int i = 0; i < kRows; ++i) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) m[i][3 * r + c] = b(r, i) * a(c, i);
      }
    }
    int unknown[kColumns] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    for (int k = 0; k < kRows; ++k) {
      int pivot = k;
      for (int c = k + 1; c < kColumns; ++c) pivot = std::abs(m[k][c]) > std::abs(m[k][pivot]) ? c : pivot;
      if (!(std::abs(m[k][pivot]) > kLeastPivot)) return false;
      if (pivot != k) {
        for (auto& row : m) std::swap(row[k], row[pivot]);
        std::swap(unknown[k], unknown[pivot]);
      }
      for (int i = k + 1; i < kRows; ++i) {
        const double share = m[i][k] / m[k][k];
        for (int c = k + 1; c < kColumns; ++c) m[i][c] -= share * m[k][c];
      }
    }
    for (int j = 0; j < 2; ++j) {
      double x[kColumns] = {};
      x[kRows + j] = 1;
      for (int k = kRows - 1; k >= 0; --k) {
        double sum = m[k][kRows + j];
        for (int c = k + 1; c < kRows; ++c) sum += m[k][c] * x[c];
        x[k] = -sum / m[k][k];
      }
      Vector9 null;
      for (int c = 0; c < kColumns; ++c) null[unknown[c]] = x[c];
      null.normalize();
      f[j] = Eigen::Map<const Matrix>(null.data());
    }
    return true;
  }

  /// det(f + x g) by its coefficients.
  static std::array<double, 4> determinant(const Eigen::Matrix3d& f, const Eigen::Matrix3d& g) {
    const double zero = f.determinant(), all = g.determinant();
    const double plus = (f + g).determinant(), minus = (f - g).determinant();
    const double square = (plus + minus) / 2 - zero;
    return {zero, (plus - minus) / 2 - all, square, all};
  }

  /// Whether all points can lie in front of both cameras: the epipole e' of the second image satisfies e' x y ~ F x with one sign.
  static bool oriented(const Eigen::Matrix3d& f, const Eigen::Matrix<double, 3, 7>& a, const Eigen::Matrix<double, 3, 7>& b) {
    // e'^T F = 0: e' is perpendicular to every column of F; the two longest tell it best.
    Eigen::Vector3d epipole = f.col(0).cross(f.col(1));
    const Eigen::Vector3d second = f.col(0).cross(f.col(2)), third = f.col(1).cross(f.col(2));
    if (second.squaredNorm() > epipole.squaredNorm()) epipole = second;
    if (third.squaredNorm() > epipole.squaredNorm()) epipole = third;
    const auto ahead = [&](int i) { return epipole.cross(b.col(i)).dot(f * a.col(i)) > 0; };
    const bool first = ahead(0);
    for (int i = 1; i < 7; ++i) {
      if (ahead(i) != first) return false;
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<ModelSpace> make_fundamental_space(const std::optional<DirectionPrior>&) { return std::make_unique<Fundamental>(); }

}  // namespace swarmfit::models
