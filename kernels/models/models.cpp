#include "kernels/models/models.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#define SWARMFIT_INLINE inline

namespace swarmfit::kernels {
namespace {
#include "kernels/models/models.inl"
}  // namespace

const ModelTraits& traits(ModelKind kind) noexcept {
  return visit_model(kind, []<class M>() -> const ModelTraits& { return M::traits; });
}

std::optional<ModelKind> model_kind(std::string_view name) noexcept {
  for (const ModelKind kind : kModelKinds) {
    if (traits(kind).name == name) return kind;
  }
  return std::nullopt;
}

bool centred_coefficients(ModelKind kind, const double* parameters, const double* centre, double* coefficients) noexcept {
  return visit_model(kind, [&]<class M>() {
    const auto finite = [](double value) { return std::isfinite(value); };
    M::centre(parameters, centre, coefficients);
    return std::all_of(parameters, parameters + M::traits.parameter_count, finite) &&
           std::all_of(coefficients, coefficients + M::traits.coefficient_count, finite);
  });
}

void centred_coefficients(ModelKind kind, std::size_t count, const double* parameters, const double* centre, float* coefficients,
                          char* finite) noexcept {
  constexpr double kMost = 1e30;
  visit_model(kind, [&]<class M>() {
    constexpr auto width = static_cast<std::size_t>(M::traits.parameter_count), own = static_cast<std::size_t>(M::traits.coefficient_count);
    for (std::size_t j = 0; j < count; ++j, parameters += width, coefficients += own) {
      double k[own];
      M::centre(parameters, centre, k);
      double probe = 0;  // stays 0 unless something is NaN or infinite
      for (std::size_t p = 0; p < width; ++p) probe += parameters[p] * 0;
      for (std::size_t c = 0; c < own; ++c) probe += k[c] * 0;
      finite[j] = probe == 0;
      for (std::size_t c = 0; c < own; ++c) coefficients[c] = probe == 0 ? static_cast<float>(std::clamp(k[c], -kMost, kMost)) : 0.0F;
    }
  });
}

float residual_steepness(ModelKind kind, const float* coefficients) noexcept {
  constexpr float kRoom = 1.0F + 1e-5F;
  const ModelTraits& model = traits(kind);
  if (!model.affine) return kRoom;  // a distance in space
  double square = 0;
  for (int d = 0; d < model.dimension; ++d) square += static_cast<double>(coefficients[d]) * static_cast<double>(coefficients[d]);
  return kRoom * static_cast<float>(std::sqrt(square));
}

float residual_rounding(ModelKind kind, const float* coefficients, const float* reach) noexcept {
  constexpr float kRounding = 2e-6F, kMost = 1e30F;
  return visit_model(kind, [&]<class M>() {
    if constexpr (M::traits.bounded) {
      return std::min(kRounding * M::magnitude(coefficients, reach), kMost) + std::numeric_limits<float>::min();
    } else {
      return kMost;
    }
  });
}

}  // namespace swarmfit::kernels
