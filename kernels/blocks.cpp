#include "kernels/blocks.hpp"

#include <cmath>

namespace swarmfit::kernels {

void principal_axes(std::array<std::array<double, 3>, 3>& matrix, std::array<std::array<double, 3>, 3>& axes, int dimension) {
  // Jacobi rotations; what is as small as that beside the variances turns no axis that is a float.
  axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto n = static_cast<std::size_t>(dimension);
  const double small = 1e-13 * (matrix[0][0] + matrix[1][1] + matrix[2][2]);
  for (int sweep = 0; sweep < 4; ++sweep) {
    for (std::size_t p = 0; p < n; ++p) {
      for (std::size_t q = p + 1; q < n; ++q) {
        if (std::abs(matrix[p][q]) <= small) continue;
        const double theta = (matrix[q][q] - matrix[p][p]) / (2 * matrix[p][q]);
        const double t = (theta >= 0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < n; ++k) {
          const double kp = matrix[k][p], kq = matrix[k][q];
          matrix[k][p] = c * kp - s * kq;
          matrix[k][q] = s * kp + c * kq;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double pk = matrix[p][k], qk = matrix[q][k];
          matrix[p][k] = c * pk - s * qk;
          matrix[q][k] = s * pk + c * qk;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const double kp = axes[k][p], kq = axes[k][q];
          axes[k][p] = c * kp - s * kq;
          axes[k][q] = s * kp + c * kq;
        }
      }
    }
  }
}

}  // namespace swarmfit::kernels
