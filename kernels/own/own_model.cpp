#include "kernels/own/own_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmfit::kernels {
namespace {

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

OwnDistances::OwnDistances(const OwnModel& own, std::span<const double> parameters, const double* centre)
    : own_(own), parameters_(parameters.begin(), parameters.end()), usable_(all_finite(parameters)) {
  if (!usable_ || !own.recentre) return;
  own.recentre({centre, static_cast<std::size_t>(own.dimension)}, parameters_);
  usable_ = all_finite(parameters_);
}

void OwnDistances::operator()(std::span<const double> rows, std::span<double> distances) const {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  std::fill(distances.begin(), distances.end(), kNowhere);
  if (!usable_ || distances.empty()) return;
  own_.residual(rows, parameters_, distances);
  for (double& d : distances) d = std::isnan(d) ? kNowhere : std::abs(d);
}

}  // namespace swarmfit::kernels
