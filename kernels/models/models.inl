// Every model's residual, written once over a `Math` policy. Has no include guard on purpose: each back end includes it inside its
// own namespace, so that every SIMD target compiles its own copy (Highway includes a file once a target).
//
// A model is a struct with `kind`, `traits`, `centre` (parameters to coefficients in the centred frame) and
// `residual(m, x, k)`, x the point's columns, k the coefficients; where blocks bound it, `magnitude` and, unless it is affine, `expand`.
// Math offers add, sub, mul, div, sqrt, mul_add(a, b, c) = a b + c, neg_mul_add(a, b, c) = c - a b, and ratio(a, b) = a / b for a >= 0,
// infinite where b is not above 0; for `expand` also set(double) and max.
#include "kernels/models/ball.inl"
#include "kernels/models/matrix3.inl"

#include "kernels/models/circle2d.inl"
#include "kernels/models/cylinder.inl"
#include "kernels/models/fundamental.inl"
#include "kernels/models/homography.inl"
#include "kernels/models/line2d.inl"
#include "kernels/models/plane.inl"
#include "kernels/models/sphere.inl"

/// Calls visitor.template operator()<Model>() for the model of that kind, which is built in.
template <class Visitor>
SWARMFIT_INLINE decltype(auto) visit_model(ModelKind kind, Visitor&& visitor) {
  switch (kind) {
    case ModelKind::line2d: return visitor.template operator()<Line2d>();
    case ModelKind::circle2d: return visitor.template operator()<Circle2d>();
    case ModelKind::sphere: return visitor.template operator()<Sphere>();
    case ModelKind::cylinder: return visitor.template operator()<Cylinder>();
    case ModelKind::homography: return visitor.template operator()<Homography>();
    case ModelKind::fundamental: return visitor.template operator()<Fundamental>();
    case ModelKind::plane:
    case ModelKind::own: break;
  }
  return visitor.template operator()<Plane>();
}
