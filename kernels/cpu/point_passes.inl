// Inner loops of the passes over the caller's points, strip by strip. Included by cpu_kernels-inl.hpp only, inside its namespace.

template <std::size_t D>
HWY_INLINE void load_rows(const float* HWY_RESTRICT rows, Vector* x) {
  const FloatTag d;
  if constexpr (D == 2) hn::LoadInterleaved2(d, rows, x[0], x[1]);
  if constexpr (D == 3) hn::LoadInterleaved3(d, rows, x[0], x[1], x[2]);
  if constexpr (D == 4) hn::LoadInterleaved4(d, rows, x[0], x[1], x[2], x[3]);
}

/// Rows less the pivot, in columns; 0 where a row is not finite.
template <std::size_t D>
struct CentredRows {
  Vector x[D];
  hn::Mask<FloatTag> usable;

  HWY_INLINE CentredRows(const float* HWY_RESTRICT rows, const float* HWY_RESTRICT pivot) {
    constexpr float kFar = 1e18F;  // its square is still a float
    const FloatTag d;
    const Vector zero = hn::Zero(d);
    load_rows<D>(rows, x);
    Vector probe = hn::Mul(x[0], zero);  // stays 0 unless a column is NaN or infinite
    for (std::size_t c = 1; c < D; ++c) probe = hn::MulAdd(x[c], zero, probe);
    usable = hn::Eq(probe, zero);
    for (std::size_t c = 0; c < D; ++c) {
      const Vector centred = hn::Clamp(hn::Sub(x[c], hn::Set(d, pivot[c])), hn::Set(d, -kFar), hn::Set(d, kFar));
      x[c] = hn::IfThenElseZero(usable, centred);
    }
  }

  /// A bit a row, into the word of row i.
  HWY_INLINE void tell(std::size_t i, std::uint64_t* HWY_RESTRICT finite) const {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(FloatTag(), usable, bits);
    finite[i / 64] |= (std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8) << (i % 64);
  }
};

/// Sums held in registers: of weights, of weighted coordinates and of their products.
template <std::size_t D>
struct VectorSums {
  Vector count, weight, square, first[D], second[D][D];

  HWY_INLINE VectorSums() {
    count = weight = square = hn::Zero(FloatTag());
    for (std::size_t a = 0; a < D; ++a) {
      first[a] = hn::Zero(FloatTag());
      for (std::size_t b = a; b < D; ++b) second[a][b] = hn::Zero(FloatTag());
    }
  }
  /// All that are finite speak alike; nobody asks for weights.
  HWY_INLINE void add(const CentredRows<D>& rows) {
    for (std::size_t a = 0; a < D; ++a) {
      first[a] = hn::Add(first[a], rows.x[a]);
      for (std::size_t b = a; b < D; ++b) second[a][b] = hn::MulAdd(rows.x[a], rows.x[b], second[a][b]);
    }
  }
  /// `w` is 0 where a point does not speak.
  HWY_INLINE void add(const Vector* x, Vector w) {
    weight = hn::Add(weight, w);
    for (std::size_t a = 0; a < D; ++a) {
      const Vector wx = hn::Mul(w, x[a]);
      first[a] = hn::Add(first[a], wx);
      for (std::size_t b = a; b < D; ++b) second[a][b] = hn::MulAdd(wx, x[b], second[a][b]);
    }
  }
  HWY_INLINE void finish(StripSums& sums) const {
    const auto total = [](Vector v) HWY_ATTR { return static_cast<double>(hn::GetLane(hn::SumOfLanes(FloatTag(), v))); };
    sums.count = total(count);
    sums.weight = total(weight);
    sums.square = total(square);
    for (std::size_t a = 0; a < D; ++a) {
      sums.first[a] = total(first[a]);
      for (std::size_t b = a; b < D; ++b) sums.second[a][b] = total(second[a][b]);
    }
  }
};

/// The rows from row i on, fewer than a vector's, and behind them such as are not finite.
template <std::size_t D>
HWY_INLINE void fill_up(const float* HWY_RESTRICT rows, std::size_t i, std::size_t count, float* HWY_RESTRICT last) {
  std::fill(last, last + D * lanes(), std::numeric_limits<float>::quiet_NaN());
  if (i < count) std::copy(rows + i * D, rows + count * D, last);
}

template <std::size_t D>
HWY_INLINE void split_of(const float* HWY_RESTRICT rows, std::size_t count, const float* HWY_RESTRICT pivot, float limit,
                         const float* HWY_RESTRICT caps, std::size_t at, Strip& strip, std::uint64_t* HWY_RESTRICT finite) {
  const FloatTag d;
  std::fill(finite, finite + (count + 63) / 64, std::uint64_t{0});
  const Vector same = hn::Set(d, limit);
  const auto put = [&](std::size_t i, const float* from, Vector allowed) HWY_ATTR {
    const CentredRows<D> here(from, pivot);
    for (std::size_t c = 0; c < D; ++c) hn::Store(here.x[c], d, strip.columns[c].data() + at + i);
    hn::Store(hn::IfThenElse(here.usable, allowed, hn::Set(d, -1.0F)), d, strip.limit.data() + at + i);
    here.tell(i, finite);
  };
  const std::size_t whole = count - count % lanes();
  for (std::size_t i = 0; i < whole; i += lanes()) put(i, rows + i * D, caps != nullptr ? hn::LoadU(d, caps + i) : same);
  HWY_ALIGN float last[D * lanes()], last_caps[lanes()] = {};
  for (std::size_t i = whole; i % kMaxLanes != 0 || i < count; i += lanes()) {
    fill_up<D>(rows, i, count, last);
    if (i < count && caps != nullptr) std::copy(caps + i, caps + count, last_caps);
    put(i, last, caps != nullptr ? hn::Load(d, last_caps) : same);
  }
  strip.count = at + count;
}

/// body.template operator()<D>() for the dimension.
template <class Body>
HWY_INLINE void with_dimension(std::size_t dimension, Body&& body) {
  if (dimension == 2) return body.template operator()<2>();
  if (dimension == 3) return body.template operator()<3>();
  body.template operator()<4>();
}

void split(const float* rows, std::size_t dimension, std::size_t count, const float* pivot, float limit, const float* caps, std::size_t at,
           Strip& strip, std::uint64_t* finite) {
  with_dimension(dimension, [&]<std::size_t D>() HWY_ATTR { split_of<D>(rows, count, pivot, limit, caps, at, strip, finite); });
}

template <std::size_t D>
HWY_INLINE void narrow_of(const double* HWY_RESTRICT rows, std::size_t count, const double* HWY_RESTRICT pivot, float* HWY_RESTRICT out) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<float, hn::ScalableTag<double>> narrow;
  constexpr std::size_t L = HWY_LANES(double);
  // The pivot as the columns of D vectors of rows have it, one after the other.
  HWY_ALIGN double pattern[D * L];
  for (std::size_t i = 0; i < D * L; ++i) pattern[i] = pivot[i % D];
  const auto most = hn::Set(d, static_cast<double>(std::numeric_limits<float>::max()));
  const auto one = [&](const double* from, std::size_t phase) HWY_ATTR {
    const auto v = hn::Sub(hn::LoadU(d, from), hn::Load(d, pattern + phase * L));
    const auto held = hn::Max(hn::Min(v, most), hn::Neg(most));
    return hn::DemoteTo(narrow, hn::Add(held, hn::Sub(v, v)));  // v - v is 0 for what is finite
  };
  const std::size_t all = D * count, whole = all - all % (D * L);
  for (std::size_t i = 0; i < whole; i += D * L) {
    for (std::size_t phase = 0; phase < D; ++phase) hn::StoreU(one(rows + i + phase * L, phase), narrow, out + i + phase * L);
  }
  HWY_ALIGN double last[D * L];
  HWY_ALIGN float last_out[D * L];
  std::fill(last, last + D * L, 0.0);
  std::copy(rows + whole, rows + all, last);
  for (std::size_t phase = 0; phase < D; ++phase) hn::StoreU(one(last + phase * L, phase), narrow, last_out + phase * L);
  std::copy(last_out, last_out + (all - whole), out + whole);
}

void narrow(const double* rows, std::size_t dimension, std::size_t count, const double* pivot, float* out) {
  with_dimension(dimension, [&]<std::size_t D>() HWY_ATTR { narrow_of<D>(rows, count, pivot, out); });
}

template <std::size_t D>
HWY_INLINE void load_columns(const Strip& strip, std::size_t i, Vector* x) {
  for (std::size_t c = 0; c < D; ++c) x[c] = hn::Load(FloatTag(), strip.columns[c].data() + i);
}

/// The same in double.
template <std::size_t D>
struct WideSums {
  using Tag = hn::ScalableTag<double>;
  using Wide = hn::Vec<Tag>;
  Wide first[D], second[D][D];

  HWY_INLINE WideSums() {
    for (std::size_t a = 0; a < D; ++a) {
      first[a] = hn::Zero(Tag());
      for (std::size_t b = a; b < D; ++b) second[a][b] = hn::Zero(Tag());
    }
  }
  HWY_INLINE void add(const Wide* x) {
    for (std::size_t a = 0; a < D; ++a) {
      first[a] = hn::Add(first[a], x[a]);
      for (std::size_t b = a; b < D; ++b) second[a][b] = hn::MulAdd(x[a], x[b], second[a][b]);
    }
  }
  HWY_INLINE void add(const CentredRows<D>& rows) {
    const Tag d;
    Wide x[D];
#if HWY_TARGET == HWY_SCALAR
    for (std::size_t c = 0; c < D; ++c) x[c] = hn::PromoteTo(d, rows.x[c]);
#else
    const hn::Rebind<float, Tag> narrow;
    for (std::size_t c = 0; c < D; ++c) x[c] = hn::PromoteTo(d, hn::LowerHalf(narrow, rows.x[c]));
    add(x);
    for (std::size_t c = 0; c < D; ++c) x[c] = hn::PromoteTo(d, hn::UpperHalf(narrow, rows.x[c]));
#endif
    add(x);
  }
  HWY_INLINE void finish(StripSums& sums) const {
    for (std::size_t a = 0; a < D; ++a) {
      sums.first[a] = hn::GetLane(hn::SumOfLanes(Tag(), first[a]));
      for (std::size_t b = a; b < D; ++b) sums.second[a][b] = hn::GetLane(hn::SumOfLanes(Tag(), second[a][b]));
    }
  }
};

template <std::size_t D, class Sums>
HWY_INLINE void survey_of(const float* HWY_RESTRICT rows, std::size_t count, const float* HWY_RESTRICT pivot, StripSums& sums,
                          std::uint64_t* HWY_RESTRICT finite) {
  const std::size_t words = (count + 63) / 64, whole = count - count % lanes();
  std::fill(finite, finite + words, std::uint64_t{0});
  Sums all;
  for (std::size_t i = 0; i < whole; i += lanes()) {
    const CentredRows<D> here(rows + i * D, pivot);
    all.add(here);
    here.tell(i, finite);
  }
  // A call in the loop would keep the sums out of registers.
  if (whole < count) {
    HWY_ALIGN float last[D * lanes()];
    fill_up<D>(rows, whole, count, last);
    const CentredRows<D> here(last, pivot);
    all.add(here);
    here.tell(whole, finite);
  }
  all.finish(sums);
  std::size_t usable = 0;
  for (std::size_t w = 0; w < words; ++w) usable += static_cast<std::size_t>(hwy::PopCount(finite[w]));
  sums.count = sums.weight = static_cast<double>(usable);
}

void survey(const float* rows, std::size_t dimension, std::size_t count, const float* pivot, StripSums& sums, std::uint64_t* finite) {
  with_dimension(dimension, [&]<std::size_t D>() HWY_ATTR { survey_of<D, VectorSums<D>>(rows, count, pivot, sums, finite); });
}

void survey_exactly(const float* rows, std::size_t dimension, std::size_t count, const float* pivot, StripSums& sums,
                    std::uint64_t* finite) {
  with_dimension(dimension, [&]<std::size_t D>() HWY_ATTR { survey_of<D, WideSums<D>>(rows, count, pivot, sums, finite); });
}

/// What there is to tell of a point's distance: nothing where it is not finite.
HWY_INLINE Vector told(Vector distance, Vector limit) {
  const FloatTag d;
  return hn::IfThenElse(hn::Ge(limit, hn::Zero(d)), distance, hn::Set(d, std::numeric_limits<float>::quiet_NaN()));
}

template <class Model>
HWY_INLINE void tell_of(const Strip& strip, const float* HWY_RESTRICT coefficients, float* HWY_RESTRICT distances) {
  constexpr std::size_t D = Model::traits.dimension;
  const FloatTag d;
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  for (std::size_t i = 0; i < strip.count; i += lanes()) {
    Vector x[D];
    load_columns<D>(strip, i, x);
    hn::StoreU(told(hn::Abs(Model::residual(VectorMath(), x, k)), hn::Load(d, strip.limit.data() + i)), d, distances + i);
  }
}

void tell(ModelKind kind, const Strip& strip, const float* coefficients, float* distances) {
  visit_model(kind, [&]<class Model>() HWY_ATTR { tell_of<Model>(strip, coefficients, distances); });
}

template <class Model>
HWY_INLINE void weigh_of(const Strip& strip, const float* HWY_RESTRICT coefficients, float tolerance, float corner, StripSums& sums,
                         float* HWY_RESTRICT distances) {
  constexpr std::size_t D = Model::traits.dimension;
  const FloatTag d;
  const Vector widest = hn::Set(d, tolerance), most = hn::Set(d, 1 / corner), zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  VectorSums<D> all;
  Vector cost = zero;
  bool any = false;
  for (std::size_t i = 0; i < strip.count; i += lanes()) {
    Vector x[D];
    load_columns<D>(strip, i, x);
    const Vector limit = hn::Load(d, strip.limit.data() + i);
    const Vector distance = hn::Abs(Model::residual(VectorMath(), x, k));
    cost = hn::Add(cost, hn::Max(least(distance, limit), zero));
    const auto speaks = hn::And(hn::Le(distance, widest), hn::Le(distance, limit));
    if (distances != nullptr) hn::StoreU(told(distance, limit), d, distances + i);
    if (hn::AllFalse(d, speaks)) continue;
    any = true;
    all.count = hn::Add(all.count, hn::IfThenElseZero(speaks, one));
    all.square = hn::Add(all.square, hn::IfThenElseZero(speaks, hn::Mul(distance, distance)));
    // A distance of 0 divides to infinity, and the corner is less.
    all.add(x, hn::IfThenElseZero(speaks, hn::Min(hn::Div(widest, distance), most)));
  }
  if (any) all.finish(sums);
  sums.cost = static_cast<double>(hn::GetLane(hn::SumOfLanes(d, cost)));
}

void weigh(ModelKind kind, const Strip& strip, const float* coefficients, float tolerance, float corner, StripSums& sums,
           float* distances) {
  visit_model(kind, [&]<class Model>() HWY_ATTR { weigh_of<Model>(strip, coefficients, tolerance, corner, sums, distances); });
}

void begin_claim(const Strip& strip, float* HWY_RESTRICT nearest, std::int32_t* HWY_RESTRICT labels) {
  const FloatTag d;
  const BitsTag bits;
  for (std::size_t i = 0; i < strip.count; i += lanes()) {
    const Vector limit = hn::Load(d, strip.limit.data() + i);
    // The next float up is the next integer up, and infinity stays what it is.
    const Vector beyond = hn::Min(hn::BitCast(d, hn::Add(hn::BitCast(bits, limit), hn::Set(bits, 1))), hn::Inf(d));
    hn::Store(hn::IfThenElse(hn::Ge(limit, hn::Zero(d)), beyond, hn::Set(d, -1.0F)), d, nearest + i);
    hn::Store(hn::Zero(bits), bits, labels + i);
  }
}

void end_claim(const std::int32_t* HWY_RESTRICT labels, std::size_t count, std::uint16_t* HWY_RESTRICT out) {
  const BitsTag bits;
  const hn::Rebind<std::uint16_t, BitsTag> narrow;
  const std::size_t whole = count - count % lanes();
  for (std::size_t i = 0; i < whole; i += lanes()) hn::StoreU(hn::DemoteTo(narrow, hn::Load(bits, labels + i)), narrow, out + i);
  for (std::size_t i = whole; i < count; ++i) out[i] = static_cast<std::uint16_t>(labels[i]);
}

template <class Model>
HWY_INLINE bool claim_of(const Strip& strip, const float* HWY_RESTRICT coefficients, std::int32_t label, float* HWY_RESTRICT nearest,
                         std::int32_t* HWY_RESTRICT labels, double& cost) {
  constexpr std::size_t D = Model::traits.dimension;
  const FloatTag d;
  const BitsTag bits;
  const Vector zero = hn::Zero(d);
  const auto mine = hn::Set(bits, label);
  Vector k[Model::traits.coefficient_count];
  for (int c = 0; c < Model::traits.coefficient_count; ++c) k[c] = hn::Set(d, coefficients[c]);
  Vector sum = zero;
  auto any = hn::Zero(bits);
  for (std::size_t i = 0; i < strip.count; i += lanes()) {
    Vector x[D];
    load_columns<D>(strip, i, x);
    const Vector distance = hn::Abs(Model::residual(VectorMath(), x, k));
    sum = hn::Add(sum, hn::Max(least(distance, hn::Load(d, strip.limit.data() + i)), zero));
    const Vector before = hn::Load(d, nearest + i);
    const auto closer = hn::Lt(distance, before);
    hn::Store(hn::IfThenElse(closer, distance, before), d, nearest + i);
    const auto won = hn::RebindMask(bits, closer);
    hn::Store(hn::IfThenElse(won, mine, hn::Load(bits, labels + i)), bits, labels + i);
    any = hn::Or(any, hn::VecFromMask(bits, won));
  }
  cost += static_cast<double>(hn::GetLane(hn::SumOfLanes(d, sum)));
  return !hn::AllTrue(bits, hn::Eq(any, hn::Zero(bits)));
}

bool claim(ModelKind kind, const Strip& strip, const float* coefficients, std::int32_t label, float* nearest, std::int32_t* labels,
           double& cost) {
  return visit_model(kind, [&]<class Model>() HWY_ATTR { return claim_of<Model>(strip, coefficients, label, nearest, labels, cost); });
}

template <std::size_t D>
HWY_INLINE void sum_labelled_of(const Strip& strip, std::int32_t label, const float* HWY_RESTRICT nearest,
                                const std::int32_t* HWY_RESTRICT labels, StripSums& sums) {
  const FloatTag d;
  const BitsTag bits;
  const auto mine = hn::Set(bits, label);
  const Vector one = hn::Set(d, 1.0F);
  VectorSums<D> all;
  for (std::size_t i = 0; i < strip.count; i += lanes()) {
    const auto speaks = hn::RebindMask(d, hn::Eq(hn::Load(bits, labels + i), mine));
    if (hn::AllFalse(d, speaks)) continue;
    Vector x[D];
    load_columns<D>(strip, i, x);
    const Vector w = hn::IfThenElseZero(speaks, one);
    const Vector distance = hn::IfThenElseZero(speaks, hn::Load(d, nearest + i));
    all.square = hn::MulAdd(distance, distance, all.square);
    all.add(x, w);
  }
  all.count = all.weight;
  all.finish(sums);
}

void sum_labelled(const Strip& strip, std::size_t dimension, std::int32_t label, const float* nearest, const std::int32_t* labels,
                  StripSums& sums) {
  with_dimension(dimension, [&]<std::size_t D>() HWY_ATTR { sum_labelled_of<D>(strip, label, nearest, labels, sums); });
}
