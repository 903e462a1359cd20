// The CPU back end's inner loops over Highway vectors. Included by cpu_kernels.cpp once for each instruction set.
#if defined(SWARMFIT_CPU_KERNELS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef SWARMFIT_CPU_KERNELS_INL
#undef SWARMFIT_CPU_KERNELS_INL
#else
#define SWARMFIT_CPU_KERNELS_INL
#endif

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
struct VectorMath {
  static HWY_INLINE Vector mul_add(Vector a, Vector b, Vector c) { return hn::MulAdd(a, b, c); }
  static HWY_INLINE Vector set(double value) { return hn::Set(FloatTag(), static_cast<float>(value)); }
};

/// The lesser of |d| and a cap >= 0, or the cap where d is NaN. Floats without a sign order as their bits do, and integer minima leave
/// the multiply-add units alone.
HWY_INLINE Vector least(Vector magnitude, Vector cap) {
  const BitsTag bits;
  return hn::BitCast(FloatTag(), hn::Min(hn::BitCast(bits, magnitude), hn::BitCast(bits, cap)));
}

template <Loss loss>
HWY_INLINE Vector limit_of(Vector cap) {
  return loss == Loss::truncated_l1 ? cap : hn::Mul(cap, cap);
}

template <Loss loss>
HWY_INLINE Vector loss_of(Vector distance, Vector limit) {
  return least(loss == Loss::truncated_l1 ? hn::Abs(distance) : hn::Mul(distance, distance), limit);
}

/// Lane sums of one block for `P` models held in registers. Two accumulators a model hide the addition's latency; their order is part
/// of the answer and the same for every P.
template <class Model, Loss loss, int P>
HWY_INLINE void block_costs(const TileView& tile, std::size_t first, const float* HWY_RESTRICT coefficients, float* HWY_RESTRICT sums) {
  constexpr int D = Model::traits.dimension;
  constexpr int C = Model::traits.coefficient_count;
  constexpr std::size_t L = lanes();
  const FloatTag d;
  const VectorMath math;
  Vector k[P][C];
  Vector sum[P][2];
  for (int p = 0; p < P; ++p) {
    for (int c = 0; c < C; ++c) k[p][c] = hn::Set(d, coefficients[p * C + c]);
    sum[p][0] = sum[p][1] = hn::Zero(d);
  }
  for (std::size_t i = first; i < first + kBlockPoints; i += 2 * L) {
    for (std::size_t half = 0; half < 2; ++half) {
      Vector x[D];
      for (int column = 0; column < D; ++column) x[column] = hn::Load(d, tile.columns[column] + i + half * L);
      const Vector limit = limit_of<loss>(hn::Load(d, tile.caps + i + half * L));
      for (int p = 0; p < P; ++p) sum[p][half] = hn::Add(sum[p][half], loss_of<loss>(Model::residual(math, x, k[p]), limit));
    }
  }
  for (int p = 0; p < P; ++p) {
    float* HWY_RESTRICT lane_sums = sums + static_cast<std::size_t>(p) * L;
    hn::Store(hn::Add(hn::Load(d, lane_sums), hn::Add(sum[p][0], sum[p][1])), d, lane_sums);
  }
}

/// Models per register tile: with fewer registers, fewer.
constexpr std::size_t models_at_once() { return HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL ? 4 : 2; }

template <class Model, Loss loss>
HWY_INLINE void add_costs_of(const TileView& tile, const float* HWY_RESTRICT coefficients, std::size_t models,
                             double* HWY_RESTRICT costs) {
  constexpr std::size_t C = Model::traits.coefficient_count;
  constexpr std::size_t P = models_at_once();
  HWY_ALIGN float sums[kGroupModels * kMaxLanes] = {};
  for (std::size_t block = 0; block < tile.blocks; ++block) {
    const std::size_t first = block * kBlockPoints;
    std::size_t j = 0;
    for (; j + P <= models; j += P) block_costs<Model, loss, P>(tile, first, coefficients + j * C, sums + j * lanes());
    for (; j < models; ++j) block_costs<Model, loss, 1>(tile, first, coefficients + j * C, sums + j * lanes());
  }
  for (std::size_t j = 0; j < models; ++j) {
    double total = 0;
    for (std::size_t lane = 0; lane < lanes(); ++lane) total += sums[j * lanes() + lane];
    costs[j] += total;
  }
}

void add_costs(ModelKind kind, Loss loss, const TileView& tile, const float* coefficients, std::size_t models, double* costs) {
  visit_model(kind, [&]<class Model>() HWY_ATTR {
    if (loss == Loss::truncated_l1) return add_costs_of<Model, Loss::truncated_l1>(tile, coefficients, models, costs);
    return add_costs_of<Model, Loss::truncated_l2>(tile, coefficients, models, costs);
  });
}

template <class Model>
HWY_INLINE void distances_of(const TileView& tile, const float* HWY_RESTRICT coefficients, float* HWY_RESTRICT out) {
  const FloatTag d;
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  for (std::size_t i = 0; i < tile.blocks * kBlockPoints; i += lanes()) {
    Vector x[Model::traits.dimension];
    for (int column = 0; column < Model::traits.dimension; ++column) x[column] = hn::Load(d, tile.columns[column] + i);
    hn::StoreU(hn::Abs(Model::residual(VectorMath(), x, k)), d, out + i);
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

/// As many chains as hide the latency of two multiply-adds a cycle and still fit the registers.
double spin_fma(std::size_t rounds, float* sink) {
  const FloatTag d;
  const Vector factor = hn::Set(d, 0.999F);
  const Vector term = hn::Set(d, 1e-3F);
  Vector a0 = term, a1 = term, a2 = term, a3 = term, a4 = term, a5 = term, a6 = term, a7 = term, a8 = term, a9 = term;
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
  const Vector all = hn::Add(hn::Add(hn::Add(a0, a1), hn::Add(a2, a3)), hn::Add(hn::Add(a4, a5), hn::Add(a6, hn::Add(a7, hn::Add(a8, a9)))));
  *sink = hn::GetLane(all);
  return 10.0 * static_cast<double>(rounds) * static_cast<double>(lanes());
}

const CpuKernels& kernel_table() {
  static const CpuKernels table{hwy::TargetName(HWY_TARGET), lanes(), add_costs, distances, keep_nearest, spin_fma};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#endif  // SWARMFIT_CPU_KERNELS_INL
