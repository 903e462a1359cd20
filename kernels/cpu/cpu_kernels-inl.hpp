// The CPU back end's inner loops over Highway vectors. Included by cpu_kernels.cpp once for each instruction set.
#if defined(SWARMFIT_CPU_KERNELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef SWARMFIT_CPU_KERNELS_INL
#undef SWARMFIT_CPU_KERNELS_INL
#else
#define SWARMFIT_CPU_KERNELS_INL
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "kernels/cpu/cpu_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#undef SWARMFIT_INLINE
#define SWARMFIT_INLINE HWY_INLINE
#include "kernels/models/models.inl"

using FloatTag = hn::ScalableTag<float>;
using BitsTag = hn::RebindToSigned<FloatTag>;
using Vector = hn::Vec<FloatTag>;

constexpr std::size_t lanes() { return HWY_LANES(float); }

/// What models.inl computes with.
template <class Tag>
struct MathOn {
  using V = hn::Vec<Tag>;
  static HWY_INLINE V set(double value) { return hn::Set(Tag(), static_cast<float>(value)); }
  static HWY_INLINE V add(V a, V b) { return hn::Add(a, b); }
  static HWY_INLINE V sub(V a, V b) { return hn::Sub(a, b); }
  static HWY_INLINE V mul(V a, V b) { return hn::Mul(a, b); }
  static HWY_INLINE V div(V a, V b) { return hn::Div(a, b); }
  static HWY_INLINE V max(V a, V b) { return hn::Max(a, b); }
  static HWY_INLINE V sqrt(V a) { return hn::Sqrt(a); }
  static HWY_INLINE V mul_add(V a, V b, V c) { return hn::MulAdd(a, b, c); }
  static HWY_INLINE V neg_mul_add(V a, V b, V c) { return hn::NegMulAdd(a, b, c); }
  static HWY_INLINE V ratio(V a, V b) { return hn::IfThenElse(hn::Gt(b, hn::Zero(Tag())), hn::Div(a, b), hn::Inf(Tag())); }
};
using VectorMath = MathOn<FloatTag>;

/// The lesser of a magnitude and a limit >= 0, or the limit where the magnitude is NaN.
HWY_INLINE Vector least(Vector magnitude, Vector limit) {
#if HWY_ARCH_X86
  return hn::Min(magnitude, limit);  // gives its second operand where one is NaN, and leaves the multiply-add units alone
#else
  // Floats without a sign order as their bits do, NaN above all.
  const BitsTag bits;
  return hn::BitCast(FloatTag(), hn::Min(hn::BitCast(bits, magnitude), hn::BitCast(bits, limit)));
#endif
}

/// The lesser of |distance| and a limit >= 0, or the limit where the distance is NaN.
HWY_INLINE Vector clipped(Vector distance, Vector limit) {
#if HWY_TARGET <= HWY_AVX3
  constexpr int kLeastMagnitude = 2, kClearSign = 2 << 2;
  return Vector{_mm512_range_ps(distance.raw, limit.raw, kClearSign | kLeastMagnitude)};  // both in one instruction
#else
  return least(hn::Abs(distance), limit);
#endif
}

template <Loss loss>
HWY_INLINE Vector limit_of(Vector cap) {
  return loss == Loss::truncated_l1 ? cap : hn::Mul(cap, cap);
}

template <Loss loss>
HWY_INLINE Vector loss_of(Vector distance, Vector limit) {
  return loss == Loss::truncated_l1 ? clipped(distance, limit) : least(hn::Mul(distance, distance), limit);
}

constexpr bool kManyRegisters = HWY_TARGET <= HWY_AVX3;

/// Models per register tile: with fewer registers, fewer; one where a residual keeps the processor busy by itself.
template <class Model>
constexpr std::size_t models_at_once() {
  if (!Model::traits.affine) return 1;
  return kManyRegisters ? 4 : 2;
}

/// A model's accumulators: few lanes add up many losses each, and two round them less. Their order is part of the answer.
constexpr std::size_t kAccumulators = lanes() < 8 ? 2 : 1;

HWY_INLINE Vector total_of(const Vector (&sum)[kAccumulators]) {
  Vector total = sum[0];
  for (std::size_t a = 1; a < kAccumulators; ++a) total = hn::Add(total, sum[a]);
  return total;
}

/// Loaded once, however often it is used: compilers would rather load for each use, and then loads are what the loop waits for.
HWY_INLINE Vector load_once(const float* from) {
  Vector v = hn::Load(FloatTag(), from);
#if HWY_TARGET <= HWY_AVX3 && (HWY_COMPILER_GCC || HWY_COMPILER_CLANG)
  asm("" : "+v"(v.raw));
#endif
  return v;
}

/// Lane sums of one block for the `P` models whose coefficients are in registers, in the same order for every P.
template <class Model, Loss loss, int P, std::size_t C>
HWY_INLINE void block_sums(const TileView& tile, std::size_t first, const Vector (&k)[P][C], Vector* total) {
  constexpr int D = Model::traits.dimension;
  constexpr std::size_t L = lanes(), A = kAccumulators;
  const FloatTag d;
  const VectorMath math;
  Vector sum[P][A];
  for (int p = 0; p < P; ++p) {
    for (std::size_t a = 0; a < A; ++a) sum[p][a] = hn::Zero(d);
  }
  for (std::size_t i = first; i < first + kBlockPoints; i += A * L) {
    for (std::size_t a = 0; a < A; ++a) {
      Vector x[D], r[P];
      for (int column = 0; column < D; ++column) x[column] = load_once(tile.columns[column] + i + a * L);
      const Vector limit = limit_of<loss>(load_once(tile.caps + i + a * L));
      for (int p = 0; p < P; ++p) r[p] = Model::residual(math, x, k[p]);
      for (int p = 0; p < P; ++p) sum[p][a] = hn::Add(sum[p][a], loss_of<loss>(r[p], limit));
    }
  }
  for (int p = 0; p < P; ++p) total[p] = total_of(sum[p]);
}

/// Whole quanta: exact however they are added up.
struct QuantumSums {
  using Lane = std::int32_t;
  static constexpr std::size_t kLanes = kMaxLanes;  ///< numbers that a model has room for
#if HWY_TARGET <= HWY_AVX3
  // A sum of at most 2^23 quanta added to 2^23 of them is rounded to a whole number of them, which its lowest bits then are; as good as a
  // product and a conversion, and the units that multiply are what everything waits for.
  static constexpr float kWhole = 0x1p23F;
  static_assert(std::size_t{1} << 27 <= (std::size_t{1} << 23) * lanes());
  Vector whole;
  explicit HWY_INLINE QuantumSums(float scale) : whole(hn::Set(FloatTag(), kWhole / scale)) {}
  HWY_INLINE hn::Vec<BitsTag> rounded(Vector lane_sums) const {
    const BitsTag d;
    return hn::Sub(hn::BitCast(d, hn::Add(lane_sums, whole)), hn::BitCast(d, whole));
  }
#else
  Vector scale;
  explicit HWY_INLINE QuantumSums(float quanta) : scale(hn::Set(FloatTag(), quanta)) {}
  HWY_INLINE hn::Vec<BitsTag> rounded(Vector lane_sums) const { return hn::NearestInt(hn::Mul(lane_sums, scale)); }
#endif
  HWY_INLINE void add(Vector lane_sums, Lane* HWY_RESTRICT to) const {
    const BitsTag d;
    hn::Store(hn::Add(hn::Load(d, to), rounded(lane_sums)), d, to);
  }
};

/// Floating point, block after block.
struct FloatSums {
  using Lane = float;
  static constexpr std::size_t kLanes = lanes();
  HWY_INLINE void add(Vector lane_sums, Lane* HWY_RESTRICT to) const {
    const FloatTag d;
    hn::Store(hn::Add(hn::Load(d, to), lane_sums), d, to);
  }
};

/// Blocks of a tile that models pass over one after the other. With those fetched for the next run they fill the first-level cache.
constexpr std::size_t kRunBlocks = 4;
struct BlockRun {
  std::size_t first, last;
};

/// `P` models over a run of blocks.
template <class Model, Loss loss, class Sums, int P>
HWY_INLINE void add_run(const TileView& tile, BlockRun run, const Sums& form, const float* const* coefficients,
                        typename Sums::Lane* const* sums) {
  constexpr std::size_t C = Model::traits.coefficient_count;
  Vector k[P][C];
  for (int p = 0; p < P; ++p) {
    for (std::size_t c = 0; c < C; ++c) k[p][c] = hn::Set(FloatTag(), coefficients[p][c]);
  }
  for (std::size_t block = run.first; block < run.last; ++block) {
    Vector total[P];
    block_sums<Model, loss, P, C>(tile, block * kBlockPoints, k, total);
    for (int p = 0; p < P; ++p) form.add(total[p], sums[p]);
  }
}

/// Asks for `count` points of every column from `first` on, so that they are near when their turn comes. Past the end does no harm.
template <class Model>
HWY_INLINE void fetch(const TileView& tile, std::size_t first, std::size_t count) {
  constexpr std::size_t kLine = 64 / sizeof(float);
  for (std::size_t i = first; i < first + count; i += kLine) {
    for (int column = 0; column < Model::traits.dimension; ++column) hwy::Prefetch(tile.columns[column] + i);
    hwy::Prefetch(tile.caps + i);
  }
}

/// A run of blocks and the listed models, as many at once as the registers hold.
template <class Model, Loss loss, class Sums>
HWY_INLINE void add_listed(const TileView& tile, BlockRun run, const Sums& form, const float* const* coefficients,
                           typename Sums::Lane* const* sums, std::size_t models) {
  constexpr std::size_t P = models_at_once<Model>();
  std::size_t j = 0;
  for (; j + P <= models; j += P) add_run<Model, loss, Sums, P>(tile, run, form, coefficients + j, sums + j);
  if constexpr (P > 2) {
    for (; j + 2 <= models; j += 2) add_run<Model, loss, Sums, 2>(tile, run, form, coefficients + j, sums + j);
  }
  for (; j < models; ++j) add_run<Model, loss, Sums, 1>(tile, run, form, coefficients + j, sums + j);
}

/// All models over the tile, run by run; while they pass over one, the next is fetched, a share for each few models.
template <class Model, Loss loss, class Sums>
HWY_INLINE void add_all(const TileView& tile, const Sums& form, const float* const* coefficients, typename Sums::Lane* const* sums,
                        std::size_t models) {
  constexpr std::size_t kFew = 2 * models_at_once<Model>();
  for (std::size_t first = 0; first < tile.blocks; first += kRunBlocks) {
    const BlockRun run{first, std::min(tile.blocks, first + kRunBlocks)};
    const std::size_t share = (run.last - run.first) * kBlockPoints * std::min(kFew, models) / models;
    std::size_t ahead = run.last * kBlockPoints;
    for (std::size_t j = 0; j < models; j += kFew, ahead += share) {
      fetch<Model>(tile, ahead, share);
      add_listed<Model, loss, Sums>(tile, run, form, coefficients + j, sums + j, std::min(kFew, models - j));
    }
  }
}

/// `blocks`: null for all, else a bit a block for each model. `sums`: Sums::kLanes numbers a model, an aligned vector at their start.
template <class Model, Loss loss, class Sums>
HWY_INLINE void add_lanes(const TileView& tile, const Sums& form, const float* HWY_RESTRICT coefficients, std::size_t models,
                          const std::uint8_t* blocks, typename Sums::Lane* HWY_RESTRICT sums) {
  constexpr std::size_t C = Model::traits.coefficient_count;
  const float* rows[kGroupModels];
  typename Sums::Lane* places[kGroupModels];
  if (blocks == nullptr) {
    for (std::size_t j = 0; j < models; ++j) {
      rows[j] = coefficients + j * C;
      places[j] = sums + j * Sums::kLanes;
    }
    return add_all<Model, loss, Sums>(tile, form, rows, places, models);
  }
  for (std::size_t block = 0; block < tile.blocks; ++block) {
    std::size_t listed = 0;
    for (std::size_t j = 0; j < models; ++j) {  // without a branch, for nobody could foresee it
      rows[listed] = coefficients + j * C;
      places[listed] = sums + j * Sums::kLanes;
      listed += (blocks[j] >> block) & 1U;
    }
    add_listed<Model, loss, Sums>(tile, {block, block + 1}, form, rows, places, listed);
  }
}

void add_units(ModelKind kind, const Summing& summing, const TileView& tile, const float* coefficients, std::size_t models,
               const std::uint8_t* blocks, std::int32_t* lane_units) {
  constexpr Loss l1 = Loss::truncated_l1, l2 = Loss::truncated_l2;
  const QuantumSums form(summing.scale);
  visit_model(kind, [&]<class Model>() HWY_ATTR {
    if (summing.loss == l1) return add_lanes<Model, l1>(tile, form, coefficients, models, blocks, lane_units);
    add_lanes<Model, l2>(tile, form, coefficients, models, blocks, lane_units);
  });
}

void settle_units(std::int32_t* HWY_RESTRICT lane_units, std::size_t models, std::int64_t* HWY_RESTRICT units) {
  for (std::size_t j = 0; j < models; ++j, lane_units += kMaxLanes) {
    std::int64_t sum = 0;
    for (std::size_t lane = 0; lane < kMaxLanes; ++lane) sum += lane_units[lane];
    std::fill_n(lane_units, kMaxLanes, 0);
    units[j] += sum;
  }
}

void add_values(ModelKind kind, Loss loss, const TileView& tile, const float* coefficients, std::size_t models, double* values) {
  HWY_ALIGN float sums[kGroupModels * lanes()];
  std::fill_n(sums, models * lanes(), 0.0F);
  visit_model(kind, [&]<class Model>() HWY_ATTR {
    if (loss == Loss::truncated_l1) return add_lanes<Model, Loss::truncated_l1>(tile, FloatSums(), coefficients, models, nullptr, sums);
    add_lanes<Model, Loss::truncated_l2>(tile, FloatSums(), coefficients, models, nullptr, sums);
  });
  for (std::size_t j = 0; j < models; ++j) {
    for (std::size_t lane = 0; lane < lanes(); ++lane) values[j] += static_cast<double>(sums[j * lanes() + lane]);
  }
}

/// In the same order as block_sums, with every loss at its limit.
template <Loss loss>
HWY_INLINE void cap_units_of(const TileView& tile, float scale, std::int32_t* units) {
  const FloatTag d;
  const QuantumSums form(scale);
  for (std::size_t block = 0; block < tile.blocks; ++block) {
    Vector sum[kAccumulators];
    for (Vector& s : sum) s = hn::Zero(d);
    const float* caps = tile.caps + block * kBlockPoints;
    for (std::size_t i = 0; i < kBlockPoints; i += kAccumulators * lanes()) {
      for (std::size_t a = 0; a < kAccumulators; ++a) sum[a] = hn::Add(sum[a], limit_of<loss>(hn::Load(d, caps + i + a * lanes())));
    }
    HWY_ALIGN std::int32_t lane_units[lanes()] = {};
    form.add(total_of(sum), lane_units);
    units[block] = 0;
    for (const std::int32_t lane : lane_units) units[block] += lane;
  }
}

void cap_units(const Summing& summing, const TileView& tile, std::int32_t* units) {
  if (summing.loss == Loss::truncated_l1) return cap_units_of<Loss::truncated_l1>(tile, summing.scale, units);
  cap_units_of<Loss::truncated_l2>(tile, summing.scale, units);
}

template <class Model>
HWY_INLINE void distances_of(const TileView& tile, const float* HWY_RESTRICT coefficients, float* HWY_RESTRICT out) {
  const FloatTag d;
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  for (std::size_t i = 0; i < tile.blocks * kBlockPoints; i += lanes()) {
    Vector x[Model::traits.dimension];
    for (int column = 0; column < Model::traits.dimension; ++column) x[column] = hn::Load(d, tile.columns[column] + i);
    hn::StoreU(least(hn::Abs(Model::residual(VectorMath(), x, k)), hn::Inf(d)), d, out + i);
  }
}

void distances(ModelKind kind, const TileView& tile, const float* coefficients, float* out) {
  visit_model(kind, [&]<class Model>() HWY_ATTR { distances_of<Model>(tile, coefficients, out); });
}

void keep_nearest(const float* HWY_RESTRICT distance, const float* HWY_RESTRICT tolerance, std::size_t count, std::uint16_t label,
                  float* HWY_RESTRICT nearest, std::uint16_t* HWY_RESTRICT labels) {
  for (std::size_t i = 0; i < count; ++i) {
    const bool better = (distance[i] < nearest[i]) & (distance[i] <= tolerance[i]);
    nearest[i] = better ? distance[i] : nearest[i];
    labels[i] = better ? label : labels[i];
  }
}

using BlockTag = hn::CappedTag<float, kTileBlocks>;
using BlockVector = hn::Vec<BlockTag>;

/// The lower bound of a block's cost, of blocks side by side; see BlockBounds for the fields. With dmax the largest |d| that the box
/// admits, min(|d|, c) >= |d| min(1, c / dmax), and sum |d| is at least |sum s_i d_i| for any signs, and sum d^2 / dmax. A curved surface
/// is taken for its tangent plane, with its bend for `slack`; farther than from one end of the block to the other no distance can change.
template <class Model, Loss loss>
struct BlockBounder {
  static constexpr std::size_t D = Model::traits.dimension;
  const TileBounds& tile;
  std::size_t at;

  HWY_INLINE BlockVector load(std::size_t field) const { return hn::Load(BlockTag(), tile.field[field] + at); }
  HWY_INLINE BlockVector dot(const BlockVector* k, std::size_t field) const {
    BlockVector sum = hn::Mul(k[0], load(field));
    for (std::size_t c = 1; c < D; ++c) sum = hn::MulAdd(k[c], load(field + c), sum);
    return sum;
  }

  struct Answer {
    hn::Mask<BlockTag> beyond, within;
    BlockVector least;
  };

  HWY_INLINE Answer operator()(const BlockVector* k, BlockVector slack) const {
    const BlockTag d;
    const BlockVector zero = hn::Zero(d), one = hn::Set(d, 1.0F);
    const BlockVector count = load(Field::count), least_cap = load(Field::least_cap), most_cap = load(Field::most_cap);
    BlockVector middle, gradient[D], half_bend = zero;
    if constexpr (Model::traits.affine) {
      middle = hn::Add(dot(k, Field::mean), k[D]);
      for (std::size_t c = 0; c < D; ++c) gradient[c] = k[c];
    } else {
      BlockVector mean[D];
      for (std::size_t c = 0; c < D; ++c) mean[c] = load(Field::mean + c);
      middle = Model::expand(MathOn<BlockTag>(), mean, k, gradient, half_bend);
      half_bend = hn::Mul(half_bend, hn::Set(d, 0.5F));
    }
    BlockVector reach = zero, variance = zero;
    for (std::size_t e = 0; e < D; ++e) {
      const BlockVector along = dot(gradient, Field::axis + 3 * e);
      reach = hn::Add(reach, hn::Abs(along));
      variance = hn::MulAdd(hn::Mul(along, along), load(Field::spread + e), variance);
    }
    BlockVector mean_slack = slack;
    if constexpr (!Model::traits.affine) {
      const BlockVector radius = load(Field::radius);
      reach = hn::Min(hn::MulAdd(half_bend, hn::Mul(radius, radius), reach), radius);
      mean_slack = hn::MulAdd(half_bend, load(Field::mean_square), mean_slack);
    }
    reach = hn::Add(reach, slack);
    const BlockVector nearest = hn::Max(hn::Sub(hn::Abs(middle), reach), zero);
    const BlockVector farthest = hn::Add(hn::Abs(middle), reach);
    const BlockVector square = hn::Mul(count, hn::MulAdd(middle, middle, variance));
    const BlockVector share = hn::Min(one, hn::Div(least_cap, farthest));
    const BlockVector cap_share = hn::Min(one, hn::Div(nearest, most_cap));
    BlockVector least;
    if (loss == Loss::truncated_l1) {
      BlockVector sum = hn::Max(hn::Mul(count, hn::Abs(middle)), hn::Div(square, farthest));
      for (std::size_t s = 0; s < D; ++s) {
        sum = hn::Max(sum, hn::Abs(hn::MulAdd(load(Field::sign_sum + s), middle, dot(gradient, Field::signed_offset + 3 * s))));
      }
      // |d| is convex: with the sides of a model near this one that is its cost and the slope of it, and near a minimum there is none.
      sum = hn::Max(sum, hn::Abs(hn::MulAdd(load(Field::side_sum), middle, dot(gradient, Field::side_offset))));
      sum = hn::Mul(hn::NegMulAdd(hn::Add(count, count), mean_slack, sum), share);
      least = hn::Max(sum, hn::Mul(load(Field::cap_sum), cap_share));
    } else {
      const BlockVector rounding = hn::Mul(hn::Mul(hn::Set(d, 2.0F), hn::Mul(mean_slack, farthest)), count);
      least = hn::Mul(hn::Sub(square, rounding), hn::Mul(share, share));
    }
    // A thousandth of a percent for the rounding of all the above and of the sums that it is compared with.
    least = hn::Mul(hn::Max(least, zero), hn::Set(d, 1.0F - 1e-5F));
    return {hn::Gt(hn::Sub(hn::Abs(middle), reach), most_cap), hn::Le(farthest, least_cap), least};
  }
};

/// Of a distance, which cannot change faster than one moves, at the centre of the tile's ball.
template <class Model>
HWY_INLINE bool out_of_reach(const TileBounds& tile, const float* HWY_RESTRICT coefficients, float slack) {
  using One = hn::CappedTag<float, 1>;
  constexpr std::size_t C = Model::traits.coefficient_count, D = Model::traits.dimension;
  hn::Vec<One> k[C], x[D];
  for (std::size_t c = 0; c < C; ++c) k[c] = hn::Set(One(), coefficients[c]);
  for (std::size_t c = 0; c < D; ++c) x[c] = hn::Set(One(), tile.ball[c]);
  const float distance = hn::GetLane(hn::Abs(Model::residual(MathOn<One>(), x, k)));
  return distance - tile.ball_radius - slack > tile.ball_cap;
}

template <class Model, Loss loss>
HWY_INLINE void bound_of(const TileBounds& tile, const float* HWY_RESTRICT coefficients, const float* HWY_RESTRICT slack,
                         std::size_t models, Open* HWY_RESTRICT open, PartialBound* HWY_RESTRICT bounds) {
  constexpr std::size_t C = Model::traits.coefficient_count;
  const BlockTag d;
  const hn::RebindToSigned<BlockTag> di;
  for (std::size_t j = 0; j < models; ++j) {
    if (out_of_reach<Model>(tile, coefficients + j * C, slack[j])) {
      bounds[j].settled += tile.all_cap_units;
      open[j] = {};
      continue;
    }
    BlockVector k[C];
    for (std::size_t c = 0; c < C; ++c) k[c] = hn::Set(d, coefficients[j * C + c]);
    BlockVector within_sum = hn::Zero(d), mixed_sum = hn::Zero(d);
    auto settled = hn::Zero(di);
    unsigned within_bits = 0, beyond_bits = 0;
    for (std::size_t at = 0; at < kTileBlocks; at += hn::Lanes(d)) {
      const auto answer = BlockBounder<Model, loss>{tile, at}(k, hn::Set(d, slack[j]));
      const auto beyond = hn::VecFromMask(d, answer.beyond), within = hn::VecFromMask(d, answer.within);
      settled = hn::Add(settled, hn::And(hn::BitCast(di, beyond), hn::Load(di, tile.cap_units + at)));
      within_sum = hn::Add(within_sum, hn::AndNot(beyond, hn::And(within, answer.least)));
      mixed_sum = hn::Add(mixed_sum, hn::AndNot(beyond, hn::AndNot(within, answer.least)));
      HWY_ALIGN std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, answer.beyond, bits);
      beyond_bits |= static_cast<unsigned>(bits[0]) << at;
      hn::StoreMaskBits(d, answer.within, bits);
      within_bits |= static_cast<unsigned>(bits[0]) << at;
    }
    bounds[j].settled += hn::GetLane(hn::SumOfLanes(di, settled));
    bounds[j].within += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, within_sum)));
    bounds[j].mixed += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, mixed_sum)));
    open[j].within = static_cast<std::uint8_t>(within_bits & ~beyond_bits);
    open[j].mixed = static_cast<std::uint8_t>(~(within_bits | beyond_bits));
  }
}

void bound(ModelKind kind, Loss loss, const TileBounds& tile, const float* coefficients, const float* slack, std::size_t models, Open* open,
           PartialBound* bounds) {
  visit_model(kind, [&]<class Model>() HWY_ATTR {
    if constexpr (Model::traits.bounded) {
      if (loss == Loss::truncated_l1) return bound_of<Model, Loss::truncated_l1>(tile, coefficients, slack, models, open, bounds);
      return bound_of<Model, Loss::truncated_l2>(tile, coefficients, slack, models, open, bounds);
    }
  });
}

#include "kernels/cpu/block_bounds.inl"

template <class Model>
HWY_INLINE void take_sides_of(const TileView& tile, const float* HWY_RESTRICT coefficients, TileBounds& bounds) {
  constexpr std::size_t D = Model::traits.dimension;
  const FloatTag d;
  const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  for (std::size_t block = 0; block < tile.blocks; ++block) {
    Vector mean[D], sides = zero, offset[D];
    for (std::size_t c = 0; c < D; ++c) {
      mean[c] = hn::Set(d, bounds.field[Field::mean + c][block]);
      offset[c] = zero;
    }
    for (std::size_t i = block * kBlockPoints; i < (block + 1) * kBlockPoints; i += lanes()) {
      Vector x[D];
      for (std::size_t c = 0; c < D; ++c) x[c] = hn::Load(d, tile.columns[c] + i);
      const auto counts = hn::Gt(hn::Load(d, tile.caps + i), zero);
      const Vector side = hn::IfThenElseZero(counts, hn::CopySign(one, Model::residual(VectorMath(), x, k)));
      sides = hn::Add(sides, side);
      for (std::size_t c = 0; c < D; ++c) offset[c] = hn::MulAdd(side, hn::Sub(x[c], mean[c]), offset[c]);
    }
    bounds.field[Field::side_sum][block] = hn::GetLane(hn::SumOfLanes(d, sides));
    for (std::size_t c = 0; c < D; ++c) bounds.field[Field::side_offset + c][block] = hn::GetLane(hn::SumOfLanes(d, offset[c]));
  }
}

void take_sides(ModelKind kind, const TileView& tile, const float* coefficients, TileBounds& bounds) {
  visit_model(kind, [&]<class Model>() HWY_ATTR {
    if constexpr (Model::traits.bounded) take_sides_of<Model>(tile, coefficients, bounds);
  });
}

#include "kernels/cpu/point_passes.inl"

/// As many chains as hide the latency of two multiply-adds a cycle and still fit the registers.
double spin_fma(std::size_t rounds, float* sink) {
  const FloatTag d;
  const Vector factor = hn::Set(d, 0.999F);
  const Vector term = hn::Set(d, 1e-3F);
  // Each starts elsewhere: compilers make one chain of equal ones.
  const auto start = [&](float value) HWY_ATTR { return hn::Set(d, value); };
  Vector a0 = start(0), a1 = start(1), a2 = start(2), a3 = start(3), a4 = start(4), a5 = start(5), a6 = start(6), a7 = start(7),
         a8 = start(8), a9 = start(9);
  for (std::size_t i = 0; i < rounds; ++i) {
    a0 = hn::MulAdd(a0, factor, term);
    a1 = hn::MulAdd(a1, factor, term);
    a2 = hn::MulAdd(a2, factor, term);
    a3 = hn::MulAdd(a3, factor, term);
    a4 = hn::MulAdd(a4, factor, term);
    a5 = hn::MulAdd(a5, factor, term);
    a6 = hn::MulAdd(a6, factor, term);
    a7 = hn::MulAdd(a7, factor, term);
    a8 = hn::MulAdd(a8, factor, term);
    a9 = hn::MulAdd(a9, factor, term);
  }
  const Vector all =
      hn::Add(hn::Add(hn::Add(a0, a1), hn::Add(a2, a3)), hn::Add(hn::Add(a4, a5), hn::Add(a6, hn::Add(a7, hn::Add(a8, a9)))));
  *sink = hn::GetLane(all);
  return 10.0 * static_cast<double>(rounds) * static_cast<double>(lanes());
}

const CpuKernels& kernel_table() {
  static const CpuKernels table{hwy::TargetName(HWY_TARGET),
                                lanes(),
                                add_values,
                                add_units,
                                settle_units,
                                cap_units,
                                bound_block,
                                bound,
                                take_sides,
                                distances,
                                keep_nearest,
                                split,
                                narrow,
                                survey,
                                survey_exactly,
                                tell,
                                weigh,
                                begin_claim,
                                claim,
                                end_claim,
                                sum_labelled,
                                spin_fma};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#endif  // SWARMFIT_CPU_KERNELS_INL
