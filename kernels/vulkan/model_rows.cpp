#include "kernels/vulkan/model_rows.hpp"

#include <algorithm>

#include "shaders/layout.h"

namespace swarmfit::kernels::vulkan {

bool write_row(ModelKind kind, std::span<const double> coefficients, bool finite, std::span<float> row) {
  std::fill(row.begin(), row.end(), 0.0F);
  // What float cannot hold is farther away than any point either way.
  constexpr double kMost = 1e30;
  for (std::size_t c = 0; finite && c < coefficients.size(); ++c) row[c] = static_cast<float>(std::clamp(coefficients[c], -kMost, kMost));
  row[layout::kKindSlot] = static_cast<float>(kind);
  return finite;
}

bool write_row(ModelKind kind, const double* parameters, const double* centre, std::span<float> row) {
  double k[kMaxCoefficients];
  const bool finite = centred_coefficients(kind, parameters, centre, k);
  return write_row(kind, std::span(k).first(static_cast<std::size_t>(traits(kind).coefficient_count)), finite, row);
}

}  // namespace swarmfit::kernels::vulkan
