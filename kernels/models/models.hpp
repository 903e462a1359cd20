// The kinds of model that kernels can evaluate.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace swarmfit::kernels {

/// The values are shared with shaders/layout.h. `own` is whatever model an evaluator was made for (kernels/own/own_model.hpp): such an
/// evaluator takes no other kind, and none but such takes it.
enum class ModelKind : std::uint32_t {
  line2d = 0,
  plane = 1,
  circle2d = 2,
  sphere = 3,
  cylinder = 4,
  homography = 5,
  fundamental = 6,
  own = 7
};

/// Those that are built in.
inline constexpr ModelKind kModelKinds[] = {ModelKind::line2d,   ModelKind::plane,      ModelKind::circle2d,   ModelKind::sphere,
                                            ModelKind::cylinder, ModelKind::homography, ModelKind::fundamental};

/// The most parameters and coefficients any kind has, and columns any point has.
inline constexpr int kMaxParameters = 9;
inline constexpr int kMaxCoefficients = 18;
inline constexpr int kMaxDimension = 4;

/// Multiply-adds that a division or a square root is counted as.
inline constexpr int kSlowOperation = 4;

struct ModelTraits {
  std::string_view name;
  int dimension = 0;          ///< columns of a point
  int parameter_count = 0;    ///< doubles in the data's frame, as results give them
  int coefficient_count = 0;  ///< scalars in the centred frame, as kernels read them
  int multiply_adds = 0;      ///< fused multiply-adds one residual is worth: what the machine's limit is divided by
  bool affine = false;        ///< the residual is n . x + offset with coefficients n, offset
  bool bounded = affine;      ///< an orthogonal distance: a block bounds it by its expansion about the block's mean
};

/// One model among several, perhaps of several kinds.
struct ModelView {
  ModelKind kind = ModelKind::plane;
  std::span<const double> parameters;  ///< in the data's own frame and unit
};

/// Of the kinds that are built in.
const ModelTraits& traits(ModelKind kind) noexcept;
std::optional<ModelKind> model_kind(std::string_view name) noexcept;

/// Parameters in the data's frame to a kernel's coefficients in the frame centred at `centre`.
/// parameters: parameter_count, centre: dimension, coefficients: coefficient_count. Returns false if a parameter or a coefficient is not
/// finite.
bool centred_coefficients(ModelKind kind, const double* parameters, const double* centre, double* coefficients) noexcept;

/// The same of `count` models one after the other, for kernels in float; what float cannot hold is farther away than any point either way.
/// coefficients: count x coefficient_count, zeros for a model that is not finite; finite: count.
void centred_coefficients(ModelKind kind, std::size_t count, const double* parameters, const double* centre, float* coefficients,
                          char* finite) noexcept;

/// How much a distance changes at most from one point to another, as a share of how far apart they are. Bounded kinds only.
float residual_steepness(ModelKind kind, const float* coefficients) noexcept;

/// What rounding may do to a residual in float, its own or a block's, at points whose coordinates are at most `reach`. Bounded kinds only.
float residual_rounding(ModelKind kind, const float* coefficients, const float* reach) noexcept;

}  // namespace swarmfit::kernels
