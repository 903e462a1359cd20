#include <algorithm>
#include <bit>

#include "host/models/projective.hpp"
#include "kernels/seven_point.hpp"

namespace swarmfit::models {
namespace {

using Svd = Eigen::JacobiSVD<Eigen::Matrix3d>;

class Fundamental final : public Projective {
 public:
  Fundamental() : Projective(kernels::PairResidual::fundamental) {}

  ModelType type() const noexcept override { return ModelType::fundamental; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::fundamental; }
  int minimal_sample() const noexcept override { return 7; }
  int freedom() const noexcept override { return 7; }

  bool from_sample(const WorkingPoints& points, std::span<const std::uint32_t> sample, Position& theta) const override {
    std::uint8_t found = 0;
    from_samples(points, sample, {&theta, 1}, {&found, 1});
    return found != 0;
  }

  void from_samples(const WorkingPoints& points, std::span<const std::uint32_t> samples, std::span<Position> thetas,
                    std::span<std::uint8_t> found) const override {
    for (std::size_t first = 0; first < found.size(); first += kernels::kSevenPointLanes) {
      const std::size_t count = std::min(kernels::kSevenPointLanes, found.size() - first);
      solve(points, samples.subspan(first * kPoints, count * kPoints), thetas.subspan(first, count), found.subspan(first, count));
    }
  }
  std::size_t samples_at_once() const noexcept override { return kernels::kSevenPointLanes; }

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
  bool residual(const WorkingPoints& points, std::uint32_t index, const Position& theta, std::span<double> components) const override {
    const Eigen::Vector4d p = points.point<4>(index);
    const Eigen::Map<const Matrix> m(theta.data());
    const Eigen::Vector3d x = first(p), y = second(p), right = m * x, left = m.transpose() * y;
    const double gradient = std::sqrt(right.head<2>().squaredNorm() + left.head<2>().squaredNorm());
    if (!(gradient > 1e-15)) return false;
    components[0] = y.dot(right) / gradient;
    return std::isfinite(components[0]);
  }

 protected:
  /// Of U diag(M, 0) V^T by small rotations of the axes of the two null vectors out of their place, and by M's three directions across it,
  /// M being 2x2: seven numbers, rank 2 throughout.
  Basis basis(const Position& theta) const override {
    const Axes at(matrix(theta));
    Basis chart(9, 7);
    for (int k = 0; k < 2; ++k) {
      chart.col(k) = flat(at.left.col(2) * (at.inner.row(k) * at.right.leftCols<2>().transpose()));
      chart.col(2 + k) = flat((at.left.leftCols<2>() * at.inner.col(k)) * at.right.col(2).transpose());
    }
    for (int k = 0; k < 3; ++k) chart.col(4 + k) = flat(at.left.leftCols<2>() * at.across(k) * at.right.leftCols<2>().transpose());
    return chart;
  }
  Position retract(const Position& theta, const Position& step) const override {
    const Axes at(matrix(theta));
    Eigen::Matrix2d inner = at.inner;
    for (int k = 0; k < 3; ++k) inner += step[4 + k] * at.across(k);
    const Eigen::Matrix<double, 3, 2> left = tilted(at.left, step.head<2>()), right = tilted(at.right, step.segment<2>(2));
    return position(left * inner * right.transpose());
  }

 private:
  static constexpr std::size_t kPoints = 7;        // of a minimal sample
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

  /// Orthonormal axes of each image, the last of them null, and what the matrix is between the other two.
  struct Axes {
    Eigen::Matrix3d left, right;
    Eigen::Matrix2d inner;

    explicit Axes(const Matrix& m) : left(about_null(m.transpose())), right(about_null(m)) {
      inner = left.leftCols<2>().transpose() * m * right.leftCols<2>();
    }
    /// Three unit directions across `inner`, of unit length itself: its products with quaternions.
    Eigen::Matrix2d across(int k) const {
      const double a = inner(0, 0), b = inner(0, 1), c = inner(1, 0), d = inner(1, 1);
      Eigen::Matrix2d by;
      if (k == 0) by << -b, a, -d, c;
      if (k == 1) by << -c, d, a, -b;
      if (k == 2) by << -d, -c, b, a;
      return by;
    }
    /// The null vector is perpendicular to every row; the two longest tell it best.
    static Eigen::Matrix3d about_null(const Matrix& m) {
      Eigen::Vector3d null = m.row(0).cross(m.row(1)).transpose();
      for (const int row : {0, 1}) {
        const Eigen::Vector3d other = m.row(row).cross(m.row(2)).transpose();
        if (other.squaredNorm() > null.squaredNorm()) null = other;
      }
      null.normalize();
      Eigen::Matrix3d axes;
      axes.col(2) = null;
      axes.col(0) = null.unitOrthogonal();
      axes.col(1) = null.cross(axes.col(0));
      return axes;
    }
  };

  /// The first two axes once the third has turned by so much towards each of them.
  static Eigen::Matrix<double, 3, 2> tilted(const Eigen::Matrix3d& axes, const Eigen::Vector2d& by) {
    const double angle = by.norm();
    if (!(angle > 1e-300)) return axes.leftCols<2>();
    const Eigen::Vector2d along = by / angle;
    // Within the plane of `along` the axes turn; across it they stay.
    const Eigen::Vector3d towards = axes.leftCols<2>() * along, turned = std::cos(angle) * towards + std::sin(angle) * axes.col(2);
    return axes.leftCols<2>() + (turned - towards) * along.transpose();
  }

  /// Seven correspondences leave a pencil of matrices, of which up to three have rank 2. Those that put points behind a camera are left
  /// out; where several remain, the sample itself, taken as a number, decides.
  void solve(const WorkingPoints& points, std::span<const std::uint32_t> samples, std::span<Position> thetas,
             std::span<std::uint8_t> found) const {
    kernels::SevenPointSamples at;
    kernels::SevenPointPencils pencils;
    for (std::size_t lane = 0; lane < kernels::kSevenPointLanes; ++lane) {
      const auto sample = samples.subspan((lane < found.size() ? lane : 0) * kPoints, kPoints);
      for (std::size_t i = 0; i < kPoints; ++i) {
        const std::array<double, 4> p = points.row<4>(sample[i]);
        for (std::size_t c = 0; c < 4; ++c) at.points[i][c][lane] = p[c];
      }
    }
    kernels::solve_seven_points(at, pencils);
    for (std::size_t lane = 0; lane < found.size(); ++lane) {
      found[lane] = 0;
      const unsigned kept = pencils.kept[lane];
      if (kept == 0) continue;
      std::size_t number = 0;
      for (const std::uint32_t i : samples.subspan(lane * kPoints, kPoints)) number = number * 31 + i;
      auto turn = number % static_cast<std::size_t>(std::popcount(kept));
      std::size_t root = 0;
      while ((kept >> root & 1U) == 0 || turn-- > 0) ++root;
      thetas[lane] = in_working_frame(at, pencils, lane, pencils.root[root][lane]);
      found[lane] = admit(thetas[lane]) ? 1 : 0;
    }
  }

  /// A matrix of a lane's pencil, about the lane's first correspondence, out of that frame.
  static Position in_working_frame(const kernels::SevenPointSamples& at, const kernels::SevenPointPencils& pencils, std::size_t lane,
                                   double x) {
    Matrix m = Matrix::Zero();
    for (std::size_t k = 0; k < pencils.one.size(); ++k) m.data()[k] = pencils.one[k][lane] + x * pencils.other[k][lane];
    const auto& origin = at.points[0];
    const double first = pencils.scale[0][lane], second = pencils.scale[1][lane];
    m.leftCols<2>() *= first;
    m.col(2) -= origin[0][lane] * m.col(0) + origin[1][lane] * m.col(1);
    m.topRows<2>() *= second;
    m.row(2) -= origin[2][lane] * m.row(0) + origin[3][lane] * m.row(1);
    return position(m);
  }
};

}  // namespace

std::unique_ptr<ModelSpace> make_fundamental_space(const std::optional<DirectionPrior>&) { return std::make_unique<Fundamental>(); }

}  // namespace swarmfit::models
