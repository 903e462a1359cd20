// Seven-point samples on vectors, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // as in cpu_kernels.cpp
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/seven_point_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/cpu/seven_point_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, kSevenPointLanes>;
using BitsTag = hn::RebindToSigned<Tag>;
using Vector = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
constexpr std::size_t kStep = HWY_MIN(HWY_LANES(double), kSevenPointLanes);

constexpr int kPoints = 7;
constexpr int kRows = kPoints - 1;  // constraints, once the first point's has taken (3, 3) away
constexpr int kEntries = 8;         // of a matrix without (3, 3)
constexpr double kLeastSize = 1e-9, kLeastPivot = 1e-6, kLeastLead = 1e-12;

HWY_INLINE Vector set(double v) { return hn::Set(Tag(), v); }
HWY_INLINE Vector square(Vector v) { return hn::Mul(v, v); }
/// a b - c d.
HWY_INLINE Vector minus(Vector a, Vector b, Vector c, Vector d) { return hn::NegMulAdd(c, d, hn::Mul(a, b)); }

/// Columns of the points about the first of them, and in units of their size.
struct Columns {
  Vector value[4][kPoints];
  Vector scale[2];
  Mask sound;

  HWY_INLINE Columns(const SevenPointSamples& samples, std::size_t lane) {
    const Tag d;
    for (int c = 0; c < 4; ++c) {
      const auto load = [&](int i) HWY_ATTR { return hn::Load(d, &samples.points[i][c][lane]); };
      const Vector origin = load(0);
      value[c][0] = hn::Zero(d);
      for (int i = 1; i < kPoints; ++i) value[c][i] = hn::Sub(load(i), origin);
    }
    sound = hn::Eq(hn::Zero(d), hn::Zero(d));
    for (int image = 0; image < 2; ++image) {
      Vector sum = hn::Zero(d);
      for (int c = 2 * image; c < 2 * image + 2; ++c) {
        for (int i = 1; i < kPoints; ++i) sum = hn::MulAdd(value[c][i], value[c][i], sum);
      }
      const Vector size = hn::Sqrt(hn::Mul(sum, set(1.0 / kRows)));
      sound = hn::And(sound, hn::Gt(size, set(kLeastSize)));
      scale[image] = hn::Div(set(1), hn::Max(size, set(kLeastSize)));
      for (int c = 2 * image; c < 2 * image + 2; ++c) {
        for (int i = 1; i < kPoints; ++i) value[c][i] = hn::Mul(value[c][i], scale[image]);
      }
    }
  }
};

/// Two orthonormal vectors that all six constraints leave at zero; false in lanes where there are more.
HWY_INLINE Mask find_pencil(const Columns& at, Vector* HWY_RESTRICT one, Vector* HWY_RESTRICT other) {
  const Tag d;
  Vector m[kRows][kEntries];  // a constraint a row; reflections from the left act along it
  for (int i = 0; i < kRows; ++i) {
    const Vector x = at.value[0][i + 1], y = at.value[1][i + 1], u = at.value[2][i + 1], v = at.value[3][i + 1];
    m[i][0] = hn::Mul(u, x);
    m[i][1] = hn::Mul(u, y);
    m[i][2] = u;
    m[i][3] = hn::Mul(v, x);
    m[i][4] = hn::Mul(v, y);
    m[i][5] = v;
    m[i][6] = x;
    m[i][7] = y;
  }
  Mask sound = at.sound;
  Vector twice[kRows];  // 2 / w^T w of each reflection I - 2 w w^T / w^T w; w is what is left in the row from the diagonal on
  const auto reflect = [&](int k, Vector* HWY_RESTRICT row) HWY_ATTR {
    Vector along = hn::Mul(m[k][k], row[k]);
    for (int c = k + 1; c < kEntries; ++c) along = hn::MulAdd(m[k][c], row[c], along);
    along = hn::Mul(along, twice[k]);
    for (int c = k; c < kEntries; ++c) row[c] = hn::NegMulAdd(along, m[k][c], row[c]);
  };
  for (int k = 0; k < kRows; ++k) {
    Vector sum = square(m[k][k]);
    for (int c = k + 1; c < kEntries; ++c) sum = hn::MulAdd(m[k][c], m[k][c], sum);
    const Vector length = hn::Sqrt(sum);
    sound = hn::And(sound, hn::Gt(length, set(kLeastPivot)));
    const Vector safe = hn::Max(length, set(kLeastPivot));
    twice[k] = hn::Div(set(1), hn::Mul(safe, hn::Add(safe, hn::Abs(m[k][k]))));
    m[k][k] = hn::Add(m[k][k], hn::CopySign(safe, m[k][k]));
    for (int i = k + 1; i < kRows; ++i) reflect(k, m[i]);
  }
  for (int c = 0; c < kEntries; ++c) one[c] = other[c] = hn::Zero(d);
  one[kRows] = other[kRows + 1] = set(1);
  for (int k = kRows; k-- > 0;) {
    reflect(k, one);
    reflect(k, other);
  }
  return sound;
}

/// (a + x b)(c + x d) - (e + x f)(g + x h), by its coefficients.
struct Quadratic {
  Vector zero, first, second;
  HWY_INLINE Quadratic(const Vector* HWY_RESTRICT one, const Vector* HWY_RESTRICT other, int a, int c, int e, int g)
      : zero(minus(one[a], one[c], one[e], one[g])),
        first(hn::Add(minus(one[a], other[c], one[e], other[g]), minus(other[a], one[c], other[e], one[g]))),
        second(minus(other[a], other[c], other[e], other[g])) {}
};

/// det(one + x other) by its coefficients: along the column that ends in 0.
HWY_INLINE void determinant(const Vector* HWY_RESTRICT one, const Vector* HWY_RESTRICT other, Vector* HWY_RESTRICT by) {
  const Quadratic upper(one, other, 3, 7, 4, 6), lower(one, other, 1, 6, 0, 7);  // beside (1, 3) and (2, 3)
  by[0] = hn::MulAdd(one[2], upper.zero, hn::Mul(one[5], lower.zero));
  by[1] = hn::MulAdd(one[2], upper.first, hn::MulAdd(other[2], upper.zero, hn::MulAdd(one[5], lower.first, hn::Mul(other[5], lower.zero))));
  by[2] =
      hn::MulAdd(one[2], upper.second, hn::MulAdd(other[2], upper.first, hn::MulAdd(one[5], lower.second, hn::Mul(other[5], lower.first))));
  by[3] = hn::MulAdd(other[2], upper.second, hn::Mul(other[5], lower.second));
}

/// About the cube root of a positive number, to a tenth: a third of its exponent.
HWY_INLINE Vector near_cube_root(Vector v) {
  const Tag d;
  const BitsTag bits;
  constexpr double kOne = 4607182418800017408.0;  // the bits of 1, as a number
  const Vector as_number = hn::ConvertTo(d, hn::BitCast(bits, v));
  return hn::BitCast(d, hn::ConvertTo(bits, hn::MulAdd(as_number, set(1.0 / 3), set(2 * kOne / 3))));
}

/// Real roots of a cubic; of three the last two only where `three` says so. The one farthest from the middle of the three comes first: from
/// there the other two are told without loss.
HWY_INLINE Mask find_roots(const Vector* HWY_RESTRICT by, Vector* HWY_RESTRICT root) {
  // A cubic whose leading coefficient is next to nothing has a root next to infinity.
  const Vector size = hn::Max(hn::Max(hn::Abs(by[0]), hn::Abs(by[1])), hn::Max(hn::Abs(by[2]), hn::Abs(by[3])));
  const Vector least = hn::Max(hn::Mul(size, set(kLeastLead)), set(1e-290));
  const Vector lead = hn::CopySign(hn::Max(hn::Abs(by[3]), least), by[3]), inverse = hn::Div(set(1), lead);
  const Vector shift = hn::Mul(hn::Mul(by[2], inverse), set(1.0 / 3)), b = hn::Mul(by[1], inverse);
  // t = x + shift: t^3 + p t + q.
  const Vector p = hn::NegMulAdd(hn::Mul(set(3), shift), shift, b);
  const Vector q = hn::MulAdd(shift, hn::Sub(hn::Mul(set(2), square(shift)), b), hn::Mul(by[0], inverse));
  // The positive root r of r^3 + p r = |q| is the largest, from a start that is off by a fourth at most.
  const Vector far = hn::Abs(q), slope = hn::Abs(p), sharp = near_cube_root(hn::Max(far, set(1e-290)));
  const Vector middle = hn::Sqrt(hn::Mul(slope, set(1.0 / 3)));
  const Mask falls = hn::Lt(p, set(0));
  const Vector above = hn::MulAdd(set(0.75), middle, sharp), below = hn::Min(sharp, hn::Div(far, hn::Max(slope, set(1e-290))));
  Vector r = hn::IfThenElse(falls, hn::Max(above, hn::Mul(set(1.87), middle)), hn::Max(below, set(1e-100)));
  r = hn::IfThenElse(hn::And(falls, hn::Lt(far, hn::Mul(set(2), hn::Mul(middle, square(middle))))), hn::Mul(set(1.87), middle), r);
  constexpr int kIterations = 4;
  for (int k = 0; k < kIterations; ++k) {
    const Vector value = hn::Sub(hn::Mul(r, hn::Add(square(r), p)), far), change = hn::MulAdd(hn::Mul(set(3), r), r, p);
    r = hn::Sub(r, hn::Div(hn::Mul(value, change), hn::NegMulAdd(hn::Mul(set(3), r), value, square(change))));
  }
  const Vector first = hn::Neg(hn::CopySign(r, q));
  const Vector inside = hn::NegMulAdd(set(3), square(first), hn::Mul(set(-4), p));
  const Mask three = hn::Ge(inside, set(0));
  // The second is the other one far away; their product with the third is -q.
  const Vector width = hn::Sqrt(hn::Max(inside, set(0)));
  const Vector second = hn::Mul(set(-0.5), hn::Add(first, hn::CopySign(width, first)));
  const Vector both = hn::Mul(first, second);
  const Vector third = hn::IfThenElseZero(hn::Gt(hn::Abs(both), set(1e-290)), hn::Div(hn::Neg(q), both));
  root[0] = hn::Sub(first, shift);
  root[1] = hn::Sub(second, shift);
  root[2] = hn::Sub(third, shift);
  return three;
}

struct Three {
  Vector x, y, z;
};
HWY_INLINE Three cross(const Three& a, const Three& b) {
  return {minus(a.y, b.z, a.z, b.y), minus(a.z, b.x, a.x, b.z), minus(a.x, b.y, a.y, b.x)};
}
HWY_INLINE Vector square(const Three& a) { return hn::MulAdd(a.x, a.x, hn::MulAdd(a.y, a.y, square(a.z))); }

/// The epipole e' of the second image: e'^T F = 0, so it is perpendicular to every column of F; the two longest tell it best.
HWY_INLINE Three epipole(const Vector* HWY_RESTRICT f) {
  const Three a{f[0], f[3], f[6]}, b{f[1], f[4], f[7]}, c{f[2], f[5], hn::Zero(Tag())};
  Three best = cross(a, b);
  Vector most = square(best);
  const auto take = [&](const Three& other) HWY_ATTR {
    const Vector now = square(other);
    const Mask more = hn::Gt(now, most);
    best = {hn::IfThenElse(more, other.x, best.x), hn::IfThenElse(more, other.y, best.y), hn::IfThenElse(more, other.z, best.z)};
    most = hn::Max(now, most);
  };
  take(cross(a, c));
  take(cross(b, c));
  return best;
}

/// Whether all points can lie in front of both cameras: e' x y ~ F x with one sign for all. Both are the same line through y, so that its
/// normal in the image, the first two entries, tells the sign.
HWY_INLINE Mask oriented(const Columns& at, const Vector* HWY_RESTRICT one, const Vector* HWY_RESTRICT other, Vector x) {
  Vector f[kEntries];
  for (int k = 0; k < kEntries; ++k) f[k] = hn::MulAdd(x, other[k], one[k]);
  const Three e = epipole(f);
  Vector least = set(0), most = set(0);
  for (int i = 0; i < kPoints; ++i) {
    const Vector normal_x = hn::MulAdd(f[0], at.value[0][i], hn::MulAdd(f[1], at.value[1][i], f[2]));
    const Vector normal_y = hn::MulAdd(f[3], at.value[0][i], hn::MulAdd(f[4], at.value[1][i], f[5]));
    const Vector ahead = minus(normal_x, hn::NegMulAdd(e.z, at.value[3][i], e.y), normal_y, hn::NegMulAdd(e.z, at.value[2][i], e.x));
    least = i == 0 ? ahead : hn::Min(least, ahead);
    most = i == 0 ? ahead : hn::Max(most, ahead);
  }
  return hn::Or(hn::Gt(least, set(0)), hn::Lt(most, set(0)));
}

void solve(const SevenPointSamples& samples, SevenPointPencils& pencils) {
  const Tag d;
  for (std::size_t lane = 0; lane < kSevenPointLanes; lane += kStep) {
    const Columns at(samples, lane);
    Vector one[kEntries], other[kEntries], by[4], root[3];
    const Mask sound = find_pencil(at, one, other);
    determinant(one, other, by);
    const Mask three = hn::And(sound, find_roots(by, root));
    std::uint8_t kept[kStep] = {};
    for (int k = 0; k < 3; ++k) {
      const Mask keep = hn::And(k == 0 ? sound : three, oriented(at, one, other, root[k]));
      hn::Store(root[k], d, &pencils.root[static_cast<std::size_t>(k)][lane]);
      double flags[kStep];
      hn::StoreU(hn::IfThenElseZero(keep, set(1)), d, flags);
      for (std::size_t i = 0; i < kStep; ++i) kept[i] = static_cast<std::uint8_t>(kept[i] | (flags[i] > 0 ? 1U << k : 0U));
    }
    for (std::size_t i = 0; i < kStep; ++i) pencils.kept[lane + i] = kept[i];
    for (std::size_t k = 0; k < kEntries; ++k) {
      hn::Store(one[k], d, &pencils.one[k][lane]);
      hn::Store(other[k], d, &pencils.other[k][lane]);
    }
    for (std::size_t image = 0; image < 2; ++image) hn::Store(at.scale[image], d, &pencils.scale[image][lane]);
  }
}

const SevenPointKernels& seven_point_kernels() {
  static const SevenPointKernels table{hwy::TargetName(HWY_TARGET), solve};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels {
namespace cpu {

HWY_EXPORT(seven_point_kernels);

const std::vector<const SevenPointKernels*>& available_seven_point_kernels() {
  static const std::vector<const SevenPointKernels*> all = runnable(HWY_DISPATCH_TABLE(seven_point_kernels));
  return all;
}

}  // namespace cpu

void solve_seven_points(const SevenPointSamples& samples, SevenPointPencils& pencils) {
  cpu::available_seven_point_kernels().front()->solve(samples, pencils);
}

}  // namespace swarmfit::kernels
#endif  // HWY_ONCE
