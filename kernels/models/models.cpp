#include "kernels/models/models.hpp"

#include <cmath>

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
    M::centre(parameters, centre, coefficients);
    for (int i = 0; i < M::traits.coefficient_count; ++i) {
      if (!std::isfinite(coefficients[i])) return false;
    }
    return true;
  });
}

}  // namespace swarmfit::kernels
