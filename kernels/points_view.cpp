#include "kernels/points_view.hpp"

#include <cmath>

namespace swarmfit::kernels {

bool PointsView::finite(std::size_t row) const noexcept {
  for (int d = 0; d < dimension; ++d) {
    if (!std::isfinite(at(row, d))) return false;
  }
  return true;
}

}  // namespace swarmfit::kernels
