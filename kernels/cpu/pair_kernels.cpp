// Least squares on correspondences on vectors, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // as in cpu_kernels.cpp
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/pair_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "kernels/cpu/pair_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
constexpr std::size_t kLanes = HWY_LANES(double);
constexpr std::size_t kColumns = 4;

HWY_INLINE Vector set(double v) { return hn::Set(Tag(), v); }
HWY_INLINE Vector square(Vector v) { return hn::Mul(v, v); }
HWY_INLINE Vector inverse(Vector v) { return hn::Div(set(1), v); }
HWY_INLINE double total(Vector v) { return hn::GetLane(hn::SumOfLanes(Tag(), v)); }
HWY_INLINE Mask finite(Vector v) { return hn::Lt(hn::Abs(v), set(std::numeric_limits<double>::infinity())); }

/// A matrix in every lane.
struct Entries {
  Vector m[9];

  HWY_INLINE explicit Entries(const double* HWY_RESTRICT matrix) {
    for (int k = 0; k < 9; ++k) m[k] = set(matrix[k]);
  }
  /// The dot product of a row with (x, y, 1), and that of a column.
  HWY_INLINE Vector row(int r, Vector x, Vector y) const { return hn::MulAdd(m[3 * r], x, hn::MulAdd(m[3 * r + 1], y, m[3 * r + 2])); }
  HWY_INLINE Vector column(int c, Vector x, Vector y) const { return hn::MulAdd(m[c], x, hn::MulAdd(m[3 + c], y, m[6 + c])); }
};

/// c(x, H) = (u - x', v - y') with (u, v) = H x, by the inverse of the lower triangular root of its covariance under unit noise in all
/// columns, which is A A^T + I, A being the image's derivative by the point.
struct HomographyResidual {
  Mask defined;
  Vector component[2];
  // Derivative of a component by an entry of the matrix: that of its row here, times the point's coordinate (x, y, 1). The first does not
  // depend on the second row.
  Vector first_by_row[3], second_by_row[3];

  HWY_INLINE HomographyResidual(const Entries& h, Vector x, Vector y, Vector there_x, Vector there_y) {
    const Vector depth = h.row(2, x, y);
    const Mask deep = hn::Gt(hn::Abs(depth), set(1e-12));
    const Vector scale = inverse(hn::IfThenElse(deep, depth, set(1)));
    const Vector u = hn::Mul(scale, h.row(0, x, y)), v = hn::Mul(scale, h.row(1, x, y));
    const Vector a = hn::Mul(scale, hn::NegMulAdd(u, h.m[6], h.m[0])), b = hn::Mul(scale, hn::NegMulAdd(u, h.m[7], h.m[1]));
    const Vector c = hn::Mul(scale, hn::NegMulAdd(v, h.m[6], h.m[3])), d = hn::Mul(scale, hn::NegMulAdd(v, h.m[7], h.m[4]));
    const Vector first_root = hn::Sqrt(hn::MulAdd(a, a, hn::MulAdd(b, b, set(1))));
    const Vector one = inverse(first_root), mixed = hn::Mul(hn::MulAdd(a, c, hn::Mul(b, d)), one);
    const Vector second_square = hn::NegMulAdd(mixed, mixed, hn::MulAdd(c, c, hn::MulAdd(d, d, set(1))));
    const Vector other = inverse(hn::Sqrt(second_square));
    const Vector first = hn::Mul(one, hn::Sub(u, there_x));
    const Vector second = hn::Mul(other, hn::NegMulAdd(mixed, first, hn::Sub(v, there_y)));
    defined = hn::And(deep, hn::And(finite(first), finite(second)));
    component[0] = hn::IfThenElseZero(defined, first);
    component[1] = hn::IfThenElseZero(defined, second);
    const Vector by_first = hn::IfThenElseZero(defined, hn::Mul(one, scale)),
                 by_second = hn::IfThenElseZero(defined, hn::Mul(other, scale));
    const Vector share = hn::IfThenElseZero(defined, hn::Mul(hn::Mul(other, mixed), by_first));
    const Vector held_u = hn::IfThenElseZero(defined, u), held_v = hn::IfThenElseZero(defined, v);
    first_by_row[0] = by_first;
    first_by_row[1] = hn::Zero(Tag());
    first_by_row[2] = hn::Neg(hn::Mul(held_u, by_first));
    second_by_row[0] = hn::Neg(share);
    second_by_row[1] = by_second;
    second_by_row[2] = hn::NegMulAdd(held_v, by_second, hn::Mul(held_u, share));
  }
  HWY_INLINE Vector squares() const { return hn::MulAdd(component[0], component[0], square(component[1])); }
};

/// c / g with c = x'^T F x and g the root of the squares of c's derivatives by the four columns.
struct FundamentalResidual {
  Mask defined;
  Vector component;
  // d(c / g) = (dc - (c / g) dg) / g, with g dg = right.d(right) + left.d(left): the derivative by an entry is ahead_i x_j - aside_i left_j.
  Vector ahead[3], aside[3], left[2];

  HWY_INLINE FundamentalResidual(const Entries& f, Vector x, Vector y, Vector there_x, Vector there_y) {
    const Vector right[2] = {f.row(0, x, y), f.row(1, x, y)};
    left[0] = f.column(0, there_x, there_y);
    left[1] = f.column(1, there_x, there_y);
    const Vector constraint = hn::MulAdd(there_x, right[0], hn::MulAdd(there_y, right[1], f.row(2, x, y)));
    const Vector deviation =
        hn::Sqrt(hn::Add(hn::MulAdd(right[0], right[0], square(right[1])), hn::MulAdd(left[0], left[0], square(left[1]))));
    const Mask steep = hn::Gt(deviation, set(1e-15));
    const Vector by_deviation = inverse(hn::IfThenElse(steep, deviation, set(1))), e = hn::Mul(constraint, by_deviation);
    defined = hn::And(steep, finite(e));
    component = hn::IfThenElseZero(defined, e);
    const Vector inverse_deviation = hn::IfThenElseZero(defined, by_deviation), bend = hn::Mul(component, inverse_deviation);
    const Vector there[3] = {there_x, there_y, set(1)};
    for (int i = 0; i < 3; ++i) {
      ahead[i] = hn::Mul(i < 2 ? hn::NegMulAdd(bend, right[i], there[i]) : there[i], inverse_deviation);
      aside[i] = hn::Mul(hn::Mul(bend, there[i]), inverse_deviation);
    }
  }
  HWY_INLINE Vector squares() const { return square(component); }
};

/// J^T W J and J^T W r where J is a product: of three numbers for the rows, and of (x, y, 1).
class HomographySums {
 public:
  HWY_INLINE HomographySums() {
    for (Vector& v : blocks_) v = hn::Zero(Tag());
    for (Vector& v : gradient_) v = hn::Zero(Tag());
  }
  HWY_INLINE void add(const HomographyResidual& at, Vector x, Vector y, Vector w) {
    const Vector *const one = at.first_by_row, *const other = at.second_by_row;
    Vector rows[6], points[6];
    int k = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) rows[k++] = hn::MulAdd(one[i], one[j], hn::Mul(other[i], other[j]));
    }
    const Vector wx = hn::Mul(w, x), wy = hn::Mul(w, y);
    points[0] = hn::Mul(wx, x);
    points[1] = hn::Mul(wx, y);
    points[2] = wx;
    points[3] = hn::Mul(wy, y);
    points[4] = wy;
    points[5] = w;
    for (int r = 0; r < 6; ++r) {
      for (int p = 0; p < 6; ++p) blocks_[6 * r + p] = hn::MulAdd(rows[r], points[p], blocks_[6 * r + p]);
    }
    for (int i = 0; i < 3; ++i) {
      const Vector pull = hn::MulAdd(one[i], at.component[0], hn::Mul(other[i], at.component[1]));
      gradient_[3 * i] = hn::MulAdd(pull, wx, gradient_[3 * i]);
      gradient_[3 * i + 1] = hn::MulAdd(pull, wy, gradient_[3 * i + 1]);
      gradient_[3 * i + 2] = hn::MulAdd(pull, w, gradient_[3 * i + 2]);
    }
  }
  HWY_INLINE void finish(PairSums& sums) const {
    static constexpr int kPlace[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};  // in a symmetric matrix's upper triangle
    double blocks[36];
    for (int k = 0; k < 36; ++k) blocks[k] = total(blocks_[k]);
    for (int i = 0; i < 9; ++i) {
      sums.gradient[static_cast<std::size_t>(i)] += total(gradient_[i]);
      for (int j = 0; j < 9; ++j) {
        sums.information[static_cast<std::size_t>(9 * i + j)] += blocks[6 * kPlace[i / 3][j / 3] + kPlace[i % 3][j % 3]];
      }
    }
  }

 private:
  Vector blocks_[36], gradient_[9];
};

class FundamentalSums {
 public:
  HWY_INLINE FundamentalSums() {
    for (Vector& v : upper_) v = hn::Zero(Tag());
    for (Vector& v : gradient_) v = hn::Zero(Tag());
  }
  HWY_INLINE void add(const FundamentalResidual& at, Vector x, Vector y, Vector w) {
    Vector by[9];
    for (int i = 0; i < 3; ++i) {
      by[3 * i] = hn::NegMulAdd(at.aside[i], at.left[0], hn::Mul(at.ahead[i], x));
      by[3 * i + 1] = hn::NegMulAdd(at.aside[i], at.left[1], hn::Mul(at.ahead[i], y));
      by[3 * i + 2] = at.ahead[i];
    }
    int k = 0;
    for (int i = 0; i < 9; ++i) {
      const Vector weighted = hn::Mul(w, by[i]);
      gradient_[i] = hn::MulAdd(weighted, at.component, gradient_[i]);
      for (int j = i; j < 9; ++j, ++k) upper_[k] = hn::MulAdd(weighted, by[j], upper_[k]);
    }
  }
  HWY_INLINE void finish(PairSums& sums) const {
    std::size_t k = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      sums.gradient[i] += total(gradient_[i]);
      for (std::size_t j = i; j < 9; ++j, ++k) {
        const double sum = total(upper_[k]);
        sums.information[9 * i + j] += sum;
        if (j != i) sums.information[9 * j + i] += sum;
      }
    }
  }

 private:
  Vector upper_[45], gradient_[9];
};

/// visit(x, y, x', y', w) on vectors of correspondences; the last is filled up with the last correspondence, of no weight. How many were so
/// added is returned.
template <class Visit>
HWY_INLINE std::size_t visit_pairs(const WeightedPairs& pairs, Visit&& visit) {
  const Tag d;
  const auto one = [&](const double* rows, const double* weights) HWY_ATTR {
    Vector x, y, there_x, there_y;
    hn::LoadInterleaved4(d, rows, x, y, there_x, there_y);
    visit(x, y, there_x, there_y, hn::LoadU(d, weights));
  };
  const std::size_t count = pairs.weights.size(), whole = count - count % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) one(pairs.rows.data() + i * kColumns, pairs.weights.data() + i);
  if (whole == count) return 0;
  HWY_ALIGN double rows[kLanes * kColumns], weights[kLanes] = {};
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::size_t from = std::min(whole + i, count - 1);
    std::copy_n(pairs.rows.data() + from * kColumns, kColumns, rows + i * kColumns);
    if (whole + i < count) weights[i] = pairs.weights[from];
  }
  one(rows, weights);
  return whole + kLanes - count;
}

template <class Residual, class Sums>
void add_sums_of(const double* matrix, const WeightedPairs& pairs, PairSums& sums) {
  if (pairs.weights.empty()) return;
  const Entries entries(matrix);
  Sums all;
  Vector squares = hn::Zero(Tag()), used = squares;
  Mask last = hn::Eq(squares, squares);
  const std::size_t filled = visit_pairs(pairs, [&](Vector x, Vector y, Vector there_x, Vector there_y, Vector w) HWY_ATTR {
    const Residual at(entries, x, y, there_x, there_y);
    all.add(at, x, y, w);
    squares = hn::MulAdd(w, at.squares(), squares);
    used = hn::Add(used, hn::IfThenElseZero(at.defined, set(1)));
    last = at.defined;
  });
  all.finish(sums);
  sums.squares += total(squares);
  sums.used += static_cast<std::size_t>(total(used));
  // What fills up the last vector is as its last correspondence is, whose lane is the highest.
  if (filled > 0 && hn::CountTrue(Tag(), hn::And(last, hn::Not(hn::FirstN(Tag(), kLanes - 1)))) > 0) sums.used -= filled;
}

template <class Residual>
double squares_of(const double* matrix, const WeightedPairs& pairs) {
  const Entries entries(matrix);
  Vector squares = hn::Zero(Tag());
  Mask everywhere = hn::Eq(squares, squares);
  visit_pairs(pairs, [&](Vector x, Vector y, Vector there_x, Vector there_y, Vector w) HWY_ATTR {
    const Residual at(entries, x, y, there_x, there_y);
    squares = hn::MulAdd(w, at.squares(), squares);
    everywhere = hn::And(everywhere, at.defined);
  });
  return hn::AllTrue(Tag(), everywhere) ? total(squares) : std::numeric_limits<double>::infinity();
}

void add_sums(PairResidual residual, const double* matrix, const WeightedPairs& pairs, PairSums& sums) {
  residual == PairResidual::homography ? add_sums_of<HomographyResidual, HomographySums>(matrix, pairs, sums)
                                       : add_sums_of<FundamentalResidual, FundamentalSums>(matrix, pairs, sums);
}

double squares(PairResidual residual, const double* matrix, const WeightedPairs& pairs) {
  return residual == PairResidual::homography ? squares_of<HomographyResidual>(matrix, pairs)
                                              : squares_of<FundamentalResidual>(matrix, pairs);
}

const PairKernels& pair_kernels() {
  static const PairKernels table{hwy::TargetName(HWY_TARGET), add_sums, squares};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels {
namespace cpu {

HWY_EXPORT(pair_kernels);

const std::vector<const PairKernels*>& available_pair_kernels() {
  static const std::vector<const PairKernels*> all = runnable(HWY_DISPATCH_TABLE(pair_kernels));
  return all;
}

}  // namespace cpu

void add_pair_sums(PairResidual residual, const double* matrix, const WeightedPairs& pairs, PairSums& sums) {
  cpu::available_pair_kernels().front()->add_sums(residual, matrix, pairs, sums);
}

double pair_squares(PairResidual residual, const double* matrix, const WeightedPairs& pairs) {
  return cpu::available_pair_kernels().front()->squares(residual, matrix, pairs);
}

}  // namespace swarmfit::kernels
#endif  // HWY_ONCE
