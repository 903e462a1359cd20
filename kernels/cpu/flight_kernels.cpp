// Flight of hyperplanes on vectors, compiled once for each instruction set.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)  // as in cpu_kernels.cpp
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/flight_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After it: it knows the target.
#include <hwy/contrib/math/math-inl.h>

#include "kernels/cpu/flight_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace swarmfit::kernels::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

template <std::size_t D>
HWY_INLINE Vector dot(const Vector* a, const Vector* b) {
  Vector sum = hn::Mul(a[0], b[0]);
  for (std::size_t d = 1; d < D; ++d) sum = hn::MulAdd(a[d], b[d], sum);
  return sum;
}

/// A hyperplane, or what is added to one.
template <std::size_t D>
struct Flat {
  Vector normal[D], offset;

  HWY_INLINE Flat(HyperplaneFlight& flight, HyperplaneFlight::Row row, std::size_t at) {
    const Tag d;
    for (std::size_t k = 0; k < D; ++k) normal[k] = hn::LoadU(d, flight.row(row, k) + at);
    offset = hn::LoadU(d, flight.row(row, D) + at);
  }
  HWY_INLINE void store(HyperplaneFlight& flight, HyperplaneFlight::Row row, std::size_t at) const {
    const Tag d;
    for (std::size_t k = 0; k < D; ++k) hn::StoreU(normal[k], d, flight.row(row, k) + at);
    hn::StoreU(offset, d, flight.row(row, D) + at);
  }
};

/// velocity += pull (to - from), entry by entry.
template <std::size_t D>
HWY_INLINE void pull_towards(const Flat<D>& from, Flat<D> to, const Flat<D>& pull, Flat<D>& velocity) {
  const Tag d;
  const Vector cosine = dot<D>(from.normal, to.normal), sign = hn::CopySignToAbs(hn::Set(d, 1.0), cosine), near = hn::Abs(cosine);
  Vector across[D];
  for (std::size_t k = 0; k < D; ++k) across[k] = hn::NegMulAdd(near, from.normal[k], hn::Mul(sign, to.normal[k]));
  const Vector sine = hn::Sqrt(dot<D>(across, across));
  // Half the angle, by its tangent: exact for small ones, and never beyond 1.
  const Vector half = hn::Div(sine, hn::Add(near, hn::Set(d, 1.0)));
  const Vector angle = hn::Mul(hn::Set(d, 2.0), hn::Atan(d, half));
  const Vector stretch = hn::IfThenElse(hn::Gt(sine, hn::Set(d, 1e-150)), hn::Div(angle, sine), hn::Set(d, 1.0));
  for (std::size_t k = 0; k < D; ++k) {
    velocity.normal[k] = hn::MulAdd(hn::Mul(pull.normal[k], stretch), across[k], velocity.normal[k]);
  }
  velocity.offset = hn::MulAdd(pull.offset, hn::Sub(hn::Mul(sign, to.offset), from.offset), velocity.offset);
}

/// Along the velocity, which is carried along.
template <std::size_t D>
HWY_INLINE void follow(Flat<D>& at, Flat<D>& velocity) {
  const Tag d;
  const Vector quarter_turn = hn::Set(d, 1.5707963267948966), one = hn::Set(d, 1.0);
  const Vector off = dot<D>(at.normal, velocity.normal);
  for (std::size_t k = 0; k < D; ++k) velocity.normal[k] = hn::NegMulAdd(off, at.normal[k], velocity.normal[k]);
  const Vector length = hn::Sqrt(dot<D>(velocity.normal, velocity.normal));
  const Vector shorter = hn::IfThenElse(hn::Gt(length, quarter_turn), hn::Div(quarter_turn, length), one);
  const Vector angle = hn::Min(length, quarter_turn);
  const Vector cosine = hn::Cos(d, angle), sine = hn::Sin(d, angle);
  const Vector per_angle = hn::IfThenElse(hn::Gt(angle, hn::Set(d, 1e-150)), hn::Div(sine, angle), one), back = hn::Mul(angle, sine);
  Vector before[D];
  for (std::size_t k = 0; k < D; ++k) {
    before[k] = at.normal[k];
    velocity.normal[k] = hn::Mul(velocity.normal[k], shorter);
    at.normal[k] = hn::MulAdd(cosine, before[k], hn::Mul(per_angle, velocity.normal[k]));
  }
  // Rounding must not add up.
  const Vector level = hn::NegMulAdd(hn::Set(d, 0.5), dot<D>(at.normal, at.normal), hn::Set(d, 1.5));
  for (std::size_t k = 0; k < D; ++k) {
    at.normal[k] = hn::Mul(at.normal[k], level);
    velocity.normal[k] = hn::NegMulAdd(back, before[k], hn::Mul(cosine, velocity.normal[k]));
  }
  at.offset = hn::Add(at.offset, velocity.offset);
}

template <std::size_t D>
HWY_INLINE void step_of(HyperplaneFlight& flight, double inertia) {
  using Row = HyperplaneFlight::Row;
  const Tag d;
  const Vector zero = hn::Zero(d);
  for (std::size_t i = 0; i < flight.places(); i += hn::Lanes(d)) {
    const Flat<D> before(flight, Row::position, i);
    Flat<D> at = before, velocity(flight, Row::velocity, i);
    for (std::size_t k = 0; k < D; ++k) velocity.normal[k] = hn::Mul(velocity.normal[k], hn::Set(d, inertia));
    velocity.offset = hn::Mul(velocity.offset, hn::Set(d, inertia));
    pull_towards(before, Flat<D>(flight, Row::own, i), Flat<D>(flight, Row::pull_own, i), velocity);
    pull_towards(before, Flat<D>(flight, Row::best, i), Flat<D>(flight, Row::pull_best, i), velocity);
    follow(at, velocity);
    Vector probe = hn::Mul(at.offset, zero);  // stays 0 unless an entry is NaN or infinite
    for (std::size_t k = 0; k < D; ++k) probe = hn::MulAdd(at.normal[k], zero, probe);
    const auto usable = hn::Eq(probe, zero);
    for (std::size_t k = 0; k < D; ++k) {
      at.normal[k] = hn::IfThenElse(usable, at.normal[k], before.normal[k]);
      velocity.normal[k] = hn::IfThenElseZero(usable, velocity.normal[k]);
    }
    at.offset = hn::IfThenElse(usable, at.offset, before.offset);
    velocity.offset = hn::IfThenElseZero(usable, velocity.offset);
    at.store(flight, Row::position, i);
    velocity.store(flight, Row::velocity, i);
  }
}

void step(HyperplaneFlight& flight, double inertia) { flight.axes() == 2 ? step_of<2>(flight, inertia) : step_of<3>(flight, inertia); }

const FlightKernels& flight_kernels() {
  static const FlightKernels table{hwy::TargetName(HWY_TARGET), step};
  return table;
}

}  // namespace HWY_NAMESPACE
}  // namespace swarmfit::kernels::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "kernels/cpu/dispatch_table.hpp"

namespace swarmfit::kernels {
namespace cpu {

HWY_EXPORT(flight_kernels);

const std::vector<const FlightKernels*>& available_flight_kernels() {
  static const std::vector<const FlightKernels*> all = runnable(HWY_DISPATCH_TABLE(flight_kernels));
  return all;
}

}  // namespace cpu

namespace {
constexpr std::size_t kMostLanes = 8;
}

HyperplaneFlight::HyperplaneFlight(std::size_t axes, std::size_t count)
    : axes_(axes), places_((count + kMostLanes - 1) / kMostLanes * kMostLanes), values_(kRows * (axes + 1) * places_) {}

void HyperplaneFlight::step(double inertia) { cpu::available_flight_kernels().front()->step(*this, inertia); }

}  // namespace swarmfit::kernels
#endif  // HWY_ONCE
