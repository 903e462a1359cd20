// Bounds of a block of stored points. Included by cpu_kernels-inl.hpp only, inside its namespace.

/// What a sum over a block in one vector of floats may be off, as a share of its terms' sizes.
constexpr float block_sum_rounding() { return static_cast<float>(kBlockPoints / lanes()) * std::numeric_limits<float>::epsilon() / 2; }

/// A block's points about their mean, in columns; all 0 where there is no cap.
template <std::size_t D>
struct BlockOffsets {
  alignas(64) float column[D][kBlockPoints];
};

/// Fills what needs no axes, and the lower triangle of the points' second moments about their mean; false where no point has a cap.
template <std::size_t D>
HWY_INLINE bool centre_block(const float* const* HWY_RESTRICT columns, const float* HWY_RESTRICT caps, BlockOffsets<D>& offsets,
                             BlockBounds& bounds, float (&second)[D][D]) {
  std::size_t first = 0;
  while (first < kBlockPoints && !(caps[first] > 0)) ++first;
  if (first == kBlockPoints) return false;
  const FloatTag d;
  const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F), none = hn::Set(d, std::numeric_limits<float>::max());
  // About one of the points: their sums are then as exact as the block is small.
  Vector pivot[D], sum[D], count = zero, cap_sum = zero, least_cap = none, most_cap = zero;
  for (std::size_t c = 0; c < D; ++c) {
    pivot[c] = hn::Set(d, columns[c][first]);
    sum[c] = zero;
  }
  for (std::size_t i = 0; i < kBlockPoints; i += lanes()) {
    const Vector cap = hn::Load(d, caps + i);
    const auto counts = hn::Gt(cap, zero);
    count = hn::Add(count, hn::IfThenElseZero(counts, one));
    cap_sum = hn::Add(cap_sum, cap);
    least_cap = hn::Min(least_cap, hn::IfThenElse(counts, cap, none));
    most_cap = hn::Max(most_cap, cap);
    for (std::size_t c = 0; c < D; ++c) {
      sum[c] = hn::Add(sum[c], hn::IfThenElseZero(counts, hn::Sub(hn::Load(d, columns[c] + i), pivot[c])));
    }
  }
  bounds.count = hn::GetLane(hn::SumOfLanes(d, count));
  bounds.cap_sum = hn::GetLane(hn::SumOfLanes(d, cap_sum));
  bounds.least_cap = hn::GetLane(hn::MinOfLanes(d, least_cap));
  bounds.most_cap = hn::GetLane(hn::MaxOfLanes(d, most_cap));
  Vector mean[D], product[D][D];
  for (std::size_t c = 0; c < D; ++c) {
    bounds.mean[c] = columns[c][first] + hn::GetLane(hn::SumOfLanes(d, sum[c])) / bounds.count;
    mean[c] = hn::Set(d, bounds.mean[c]);
    for (std::size_t b = 0; b <= c; ++b) product[c][b] = zero;
  }
  for (std::size_t i = 0; i < kBlockPoints; i += lanes()) {
    const auto counts = hn::Gt(hn::Load(d, caps + i), zero);
    Vector x[D];
    for (std::size_t c = 0; c < D; ++c) {
      x[c] = hn::IfThenElseZero(counts, hn::Sub(hn::Load(d, columns[c] + i), mean[c]));
      hn::Store(x[c], d, offsets.column[c] + i);
      for (std::size_t b = 0; b <= c; ++b) product[c][b] = hn::MulAdd(x[c], x[b], product[c][b]);
    }
  }
  for (std::size_t c = 0; c < D; ++c) {
    for (std::size_t b = 0; b <= c; ++b) second[c][b] = hn::GetLane(hn::SumOfLanes(d, product[c][b]));
  }
  return true;
}

/// The box and the signed sums along one axis of unit length, along which the points have this variance or more.
template <std::size_t D>
HWY_INLINE void bound_axis(const BlockOffsets<D>& offsets, const float* HWY_RESTRICT caps, const float (&axis)[D], double variance,
                           std::size_t e, BlockBounds& bounds) {
  const FloatTag d;
  const Vector zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  Vector k[D], signed_offset[D], signs = zero, reach = zero;
  for (std::size_t c = 0; c < D; ++c) {
    k[c] = hn::Set(d, axis[c]);
    signed_offset[c] = zero;
  }
  for (std::size_t i = 0; i < kBlockPoints; i += lanes()) {
    Vector x[D];
    for (std::size_t c = 0; c < D; ++c) x[c] = hn::Load(d, offsets.column[c] + i);
    Vector along = hn::Mul(k[0], x[0]);
    for (std::size_t c = 1; c < D; ++c) along = hn::MulAdd(k[c], x[c], along);
    reach = hn::Max(reach, hn::Abs(along));
    const Vector sign = hn::IfThenElseZero(hn::Gt(hn::Load(d, caps + i), zero), hn::CopySign(one, along));
    signs = hn::Add(signs, sign);
    for (std::size_t c = 0; c < D; ++c) signed_offset[c] = hn::MulAdd(sign, x[c], signed_offset[c]);
  }
  const float farthest = hn::GetLane(hn::MaxOfLanes(d, reach));
  for (std::size_t c = 0; c < D; ++c) {
    bounds.axis[e][c] = axis[c] * farthest;
    bounds.signed_offset[e][c] = hn::GetLane(hn::SumOfLanes(d, signed_offset[c]));
  }
  const double square = static_cast<double>(farthest) * static_cast<double>(farthest);
  bounds.spread[e] = square > 0 ? static_cast<float>(variance / square) : 0.0F;
  bounds.sign_sum[e] = hn::GetLane(hn::SumOfLanes(d, signs));
}

template <std::size_t D>
HWY_INLINE void bound_block_of(const float* const* HWY_RESTRICT columns, const float* HWY_RESTRICT caps, BlockBounds& bounds) {
  BlockOffsets<D> offsets;
  float second[D][D];
  if (!centre_block<D>(columns, caps, offsets, bounds, second)) return;
  std::array<std::array<double, 3>, 3> covariance{}, axes{};
  for (std::size_t a = 0; a < D; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      covariance[a][b] = covariance[b][a] = static_cast<double>(second[a][b]) / static_cast<double>(bounds.count);
    }
  }
  principal_axes(covariance, axes, static_cast<int>(D));
  // What the sums above and the axes' own rounding may have added to the variance in any direction; it may well make one negative.
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  const double rounding = 4.0 * static_cast<double>(block_sum_rounding()) * trace;
  double square = 0;
  for (std::size_t e = 0; e < D; ++e) {
    float axis[D];
    for (std::size_t c = 0; c < D; ++c) axis[c] = static_cast<float>(axes[c][e]);
    bound_axis<D>(offsets, caps, axis, covariance[e][e] - rounding, e, bounds);
    for (std::size_t c = 0; c < D; ++c) square += static_cast<double>(bounds.axis[e][c]) * static_cast<double>(bounds.axis[e][c]);
  }
  bounds.mean_square = static_cast<float>(trace + rounding);
  bounds.radius = static_cast<float>(std::sqrt(square) * (1 + 1e-5));
}

void bound_block(const float* const* columns, const float* caps, int dimension, BlockBounds& bounds) {
  bounds = {};
  if (dimension == 2) return bound_block_of<2>(columns, caps, bounds);
  bound_block_of<3>(columns, caps, bounds);
}
