// Tallies on vectors, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // as in cpu_kernels.cpp
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/tally_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <hwy/contrib/math/math-inl.h>

#include "kernels/cpu/tally_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using ByteTag = hn::Rebind<std::uint8_t, FloatTag>;
using DoubleTag = hn::ScalableTag<double>;
using Vector = hn::Vec<FloatTag>;
using Wide = hn::Vec<DoubleTag>;
using Integers = hn::Vec<IntTag>;
using Mask = hn::Mask<FloatTag>;
constexpr std::size_t kLanes = HWY_LANES(float);

/// Both halves of a vector in double.
struct Halves {
  Wide low, high;

  HWY_INLINE explicit Halves(Vector v) {
    const DoubleTag d;
#if HWY_TARGET == HWY_SCALAR
    low = hn::PromoteTo(d, v);
    high = hn::Zero(d);
#else
    const hn::Rebind<float, DoubleTag> narrow;
    low = hn::PromoteTo(d, hn::LowerHalf(narrow, v));
    high = hn::PromoteTo(d, hn::UpperHalf(narrow, v));
#endif
  }
};

HWY_INLINE double total(Wide v) { return hn::GetLane(hn::SumOfLanes(DoubleTag(), v)); }

/// As SlabCounts, a lane each.
struct LaneCounts {
  Integers open, inner, marked, shared, slabs[SlabCounts::kSlabs];
  Wide square;

  HWY_INLINE LaneCounts() {
    open = inner = marked = shared = hn::Zero(IntTag());
    for (Integers& slab : slabs) slab = hn::Zero(IntTag());
    square = hn::Zero(DoubleTag());
  }

  HWY_INLINE void add_square(Vector v) {
    const Halves halves(v);
    square = hn::MulAdd(halves.low, halves.low, square);
    square = hn::MulAdd(halves.high, halves.high, square);
  }
  HWY_INLINE void finish(SlabCounts& counts) {
    const auto of_all = [](Integers v) HWY_ATTR { return static_cast<std::size_t>(hn::GetLane(hn::SumOfLanes(IntTag(), v))); };
    counts.square += total(square);
    counts.open += of_all(open);
    counts.inner += of_all(inner);
    counts.marked += of_all(marked);
    counts.shared += of_all(shared);
    for (std::size_t k = 0; k < SlabCounts::kSlabs; ++k) counts.slabs[k] += of_all(slabs[k]);
  }
};

HWY_INLINE Integers ones_where(Mask mask) { return hn::IfThenElseZero(hn::RebindMask(IntTag(), mask), hn::Set(IntTag(), 1)); }

/// What is asked of each point, a lane each.
struct Widths {
  Vector width, half, reach, per_width, least_cap, farther;

  HWY_INLINE explicit Widths(const SlabsView& view) {
    const FloatTag d;
    width = hn::Set(d, view.width);
    half = hn::Set(d, 0.5F * view.width);
    farther = hn::Set(d, static_cast<float>(SlabCounts::kSlabs));
    reach = hn::Set(d, static_cast<float>(SlabCounts::kSlabs) * view.width);
    per_width = hn::Set(d, 1 / view.width);
    least_cap = hn::Set(d, view.least_cap);
  }
};

HWY_INLINE void count_vector(const Widths& w, Vector distance, Vector cap, const std::uint8_t* HWY_RESTRICT marks,
                             const float* HWY_RESTRICT others, LaneCounts& counts) {
  const FloatTag d;
  const IntTag bits;
  const Mask open = hn::And(hn::Ge(cap, w.least_cap), hn::Eq(distance, distance));
  counts.open = hn::Add(counts.open, ones_where(open));
  const Vector slab = hn::IfThenElse(hn::Lt(distance, w.reach), hn::Mul(distance, w.per_width), w.farther);
  const Integers place = hn::ConvertTo(bits, hn::IfThenElse(open, hn::Min(slab, w.farther), w.farther));
  for (std::size_t k = 0; k < SlabCounts::kSlabs; ++k) {
    const auto there = hn::Eq(place, hn::Set(bits, static_cast<std::int32_t>(k)));
    counts.slabs[k] = hn::Add(counts.slabs[k], hn::IfThenElseZero(there, hn::Set(bits, 1)));
  }
  const Mask first = hn::RebindMask(d, hn::Eq(place, hn::Zero(bits)));
  if (others != nullptr) {
    const Vector other = hn::LoadU(d, others);
    const Mask near = hn::And(hn::Lt(distance, w.width), hn::And(hn::Lt(other, w.width), hn::Lt(distance, other)));
    counts.shared = hn::Add(counts.shared, ones_where(hn::And(near, hn::Not(open))));
  }
  if (hn::AllFalse(d, first)) return;
  counts.add_square(hn::IfThenElseZero(first, distance));
  counts.inner = hn::Add(counts.inner, ones_where(hn::And(first, hn::Lt(distance, w.half))));
  if (marks != nullptr) {
    const Integers marked = hn::PromoteTo(bits, hn::LoadU(ByteTag(), marks));
    counts.marked = hn::Add(counts.marked, hn::IfThenElseZero(hn::RebindMask(bits, first), marked));
  }
}

void count_slabs(const SlabsView& view, SlabCounts& counts) {
  const FloatTag d;
  const Widths widths(view);
  const std::size_t n = view.distances.size(), whole = n - n % kLanes;
  const float *const distances = view.distances.data(), *const caps = view.caps.data();
  const std::uint8_t* const marks = view.marks.empty() ? nullptr : view.marks.data();
  const float* const others = view.others.empty() ? nullptr : view.others.data();
  LaneCounts lanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    count_vector(widths, hn::LoadU(d, distances + i), hn::LoadU(d, caps + i), marks != nullptr ? marks + i : nullptr,
                 others != nullptr ? others + i : nullptr, lanes);
  }
  if (whole < n) {
    HWY_ALIGN float last_distances[kLanes], last_caps[kLanes] = {}, last_others[kLanes] = {};
    HWY_ALIGN std::uint8_t last_marks[kLanes] = {};
    std::fill(last_distances, last_distances + kLanes, std::numeric_limits<float>::quiet_NaN());
    std::copy(distances + whole, distances + n, last_distances);
    std::copy(caps + whole, caps + n, last_caps);
    if (marks != nullptr) std::copy(marks + whole, marks + n, last_marks);
    if (others != nullptr) std::copy(others + whole, others + n, last_others);
    count_vector(widths, hn::Load(d, last_distances), hn::Load(d, last_caps), marks != nullptr ? last_marks : nullptr,
                 others != nullptr ? last_others : nullptr, lanes);
  }
  lanes.finish(counts);
}

/// One value for all points, or where there is a list one a point.
class Each {
 public:
  HWY_INLINE Each(float all, std::span<const float> each) : all_(hn::Set(FloatTag(), all)), each_(each.empty() ? nullptr : each.data()) {}
  HWY_INLINE bool differs() const { return each_ != nullptr; }
  HWY_INLINE Vector at(std::size_t i) const { return each_ != nullptr ? hn::LoadU(FloatTag(), each_ + i) : all_; }

 private:
  Vector all_;
  const float* each_;
};

class Sinker {
 public:
  HWY_INLINE explicit Sinker(const Sinking& how)
      : widths_(how.width, how.widths),
        reaches_(how.reach, how.reaches),
        slope_(hn::Set(FloatTag(), how.slope)),
        width_(hn::Set(FloatTag(), how.width)),
        marked_(hn::Set(FloatTag(), how.marked * how.width)) {}

  /// `marks` and `others` may be null.
  HWY_INLINE void sink(std::size_t i, const float* distances, std::uint8_t* marks, float* others, float* caps) const {
    const FloatTag d;
    const Vector distance = hn::LoadU(d, distances), width = widths_.at(i);
    if (marks != nullptr || others != nullptr)
      mark(widths_.differs() ? hn::Mul(distance, hn::Div(width_, width)) : distance, marks, others);
    const Vector cap = hn::LoadU(d, caps), left = hn::Mul(slope_, hn::Sub(distance, hn::Mul(reaches_.at(i), width)));
    const Vector less = hn::IfThenElseZero(hn::Gt(left, hn::Zero(d)), left);
    hn::StoreU(hn::IfThenElse(hn::Lt(left, cap), less, cap), d, caps);
  }

 private:
  HWY_INLINE void mark(Vector levelled, std::uint8_t* marks, float* others) const {
    const FloatTag d;
    if (marks != nullptr) {
      const auto here = hn::DemoteTo(ByteTag(), ones_where(hn::Lt(levelled, marked_)));
      hn::StoreU(hn::Or(hn::LoadU(ByteTag(), marks), here), ByteTag(), marks);
    }
    if (others != nullptr) {
      const Vector before = hn::LoadU(d, others);
      hn::StoreU(hn::IfThenElse(hn::Lt(levelled, before), levelled, before), d, others);
    }
  }

  Each widths_, reaches_;
  Vector slope_, width_, marked_;
};

void sink(std::span<const float> distances, const Sinking& how, std::uint8_t* marks, float* others, float* caps) {
  const Sinker sinker(how);
  const std::size_t n = distances.size(), whole = n - n % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    sinker.sink(i, distances.data() + i, marks != nullptr ? marks + i : nullptr, others != nullptr ? others + i : nullptr, caps + i);
  }
  if (whole == n) return;
  HWY_ALIGN float last_distances[kLanes] = {}, last_caps[kLanes] = {}, last_others[kLanes] = {}, last_widths[kLanes], last_reaches[kLanes];
  HWY_ALIGN std::uint8_t last_marks[kLanes] = {};
  const std::size_t rest = n - whole;
  std::copy_n(distances.data() + whole, rest, last_distances);
  std::copy_n(caps + whole, rest, last_caps);
  if (marks != nullptr) std::copy_n(marks + whole, rest, last_marks);
  if (others != nullptr) std::copy_n(others + whole, rest, last_others);
  Sinking last = how;
  const auto take_last = [&](std::span<const float>& each, float all, float* room) {
    std::fill_n(room, kLanes, all);
    if (each.empty()) return;
    std::copy_n(each.data() + whole, rest, room);
    each = std::span<const float>(room, kLanes);
  };
  take_last(last.widths, how.width, last_widths);
  take_last(last.reaches, how.reach, last_reaches);
  Sinker(last).sink(0, last_distances, marks != nullptr ? last_marks : nullptr, others != nullptr ? last_others : nullptr, last_caps);
  std::copy_n(last_caps, rest, caps + whole);
  if (marks != nullptr) std::copy_n(last_marks, rest, marks + whole);
  if (others != nullptr) std::copy_n(last_others, rest, others + whole);
}

double saved(std::span<const float> caps, std::span<const float> distances) {
  const FloatTag d;
  const std::size_t n = distances.size(), whole = n - n % kLanes;
  Wide low = hn::Zero(DoubleTag()), high = low;
  const auto add = [&](Vector cap, Vector distance) HWY_ATTR {
    const Halves less(hn::IfThenElseZero(hn::Lt(distance, cap), hn::Sub(cap, distance)));
    low = hn::Add(low, less.low);
    high = hn::Add(high, less.high);
  };
  for (std::size_t i = 0; i < whole; i += kLanes) add(hn::LoadU(d, caps.data() + i), hn::LoadU(d, distances.data() + i));
  if (whole < n) {
    HWY_ALIGN float last_caps[kLanes] = {}, last_distances[kLanes] = {};
    std::copy(caps.begin() + static_cast<std::ptrdiff_t>(whole), caps.end(), last_caps);
    std::copy(distances.begin() + static_cast<std::ptrdiff_t>(whole), distances.end(), last_distances);
    add(hn::Load(d, last_caps), hn::Load(d, last_distances));
  }
  return total(hn::Add(low, high));
}

void bend(std::span<float> distances, const Bending& how) {
  const FloatTag d;
  const Vector per_bend = hn::Set(d, 1 / (how.bend * how.unit)), unit = hn::Set(d, how.unit / std::log1p(1 / how.bend));
  const Vector farthest = hn::Set(d, how.farthest * how.unit), beyond = hn::Set(d, how.beyond * how.unit);
  const auto bent = [&](Vector distance) HWY_ATTR {
    const Vector near = hn::Mul(unit, hn::Log1p(d, hn::Mul(distance, per_bend)));
    return hn::IfThenElse(hn::Gt(distance, farthest), beyond, near);
  };
  const std::size_t n = distances.size(), whole = n - n % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) hn::StoreU(bent(hn::LoadU(d, distances.data() + i)), d, distances.data() + i);
  if (whole == n) return;
  HWY_ALIGN float last[kLanes] = {};
  std::copy(distances.begin() + static_cast<std::ptrdiff_t>(whole), distances.end(), last);
  hn::Store(bent(hn::Load(d, last)), d, last);
  std::copy_n(last, n - whole, distances.data() + whole);
}

const TallyKernels& tally_kernels() {
  static const TallyKernels table{hwy::TargetName(HWY_TARGET), count_slabs, sink, saved, bend};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels {
namespace cpu {

HWY_EXPORT(tally_kernels);

const std::vector<const TallyKernels*>& available_tally_kernels() {
  static const std::vector<const TallyKernels*> all = runnable(HWY_DISPATCH_TABLE(tally_kernels));
  return all;
}

}  // namespace cpu

void count_slabs(const SlabsView& view, SlabCounts& counts) { cpu::available_tally_kernels().front()->count_slabs(view, counts); }

void sink(std::span<const float> distances, const Sinking& how, std::span<std::uint8_t> marks, std::span<float> others,
          std::span<float> caps) {
  cpu::available_tally_kernels().front()->sink(distances, how, marks.empty() ? nullptr : marks.data(),
                                               others.empty() ? nullptr : others.data(), caps.data());
}

double saved(std::span<const float> caps, std::span<const float> distances) {
  return cpu::available_tally_kernels().front()->saved(caps, distances);
}

void bend(std::span<float> distances, const Bending& how) { cpu::available_tally_kernels().front()->bend(distances, how); }

}  // namespace swarmfit::kernels
#endif  // HWY_ONCE
