// Every model's residual, written once over a `Math` policy. Has no include guard on purpose: each back end includes it inside its
// own namespace, so that every SIMD target compiles its own copy (Highway includes a file once a target).
//
// A model is a struct with `kind`, `traits`, `centre` (parameters to coefficients in the centred frame) and
// `residual(m, x, k)`, x the point's columns, k the coefficients. Math offers mul_add(a, b, c) = a b + c and set(double).
#include "kernels/models/line2d.inl"
#include "kernels/models/plane.inl"

/// Calls visitor.template operator()<Model>() for the model of that kind.
template <class Visitor>
SWARMFIT_INLINE decltype(auto) visit_model(ModelKind kind, Visitor&& visitor) {
  switch (kind) {
    case ModelKind::line2d: return visitor.template operator()<Line2d>();
    case ModelKind::plane: break;
  }
  return visitor.template operator()<Plane>();
}
