#include <cmath>

#include <fmt/format.h>

#include <swarmfit/perception.hpp>

namespace swarmfit {
namespace {

constexpr double kHalfPi = 1.5707963267948966;

/// `ok` is false for NaN as well, if it is written as a positive comparison.
template <class T>
Expected<> require(bool ok, const char* field, const T& value, const char* bound) {
  if (ok) return {};
  return fail(Error::Kind::invalid_option, fmt::format("{} is {}, must be {}", field, value, bound));
}

bool positive(double v) { return v > 0 && std::isfinite(v); }

Expected<> check_gravity(const Eigen::Vector3d& g) {
  if (g.allFinite() && g.norm() > 0) return {};
  return fail(Error::Kind::invalid_option, fmt::format("gravity is ({}, {}, {}), must be finite and not zero", g.x(), g.y(), g.z()));
}

}  // namespace

Expected<> PerceiveOptions::validate() const {
  if (auto ok = fit.validate(); !ok) return ok;
  if (fit.noise != Noise::none) {
    return fail(Error::Kind::invalid_option, "fit.noise is depth, must be none: perception has its own measure of a depth's noise");
  }
  if (!fit.rivals.empty()) {
    return fail(Error::Kind::invalid_option,
                fmt::format("fit.rivals is {}, must be empty: perception looks for planes", name(fit.rivals.front())));
  }
  if (gravity && camera_tilt) return fail(Error::Kind::invalid_option, "gravity and camera_tilt are both given, must be one of them");
  if (gravity) {
    if (auto ok = check_gravity(*gravity); !ok) return ok;
  }
  Expected<> checks[] = {
      require(fit.model == ModelType::plane, "model", name(fit.model), "plane"),
      require(!camera_tilt || std::abs(*camera_tilt) <= kHalfPi, "camera_tilt", camera_tilt.value_or(0), "in [-pi/2, pi/2] rad"),
      require(horizontal_angle > 0 && horizontal_angle < kHalfPi, "horizontal_angle", horizontal_angle, "in (0, pi/2) rad"),
      require(min_plane_share > 0 && min_plane_share < 1, "min_plane_share", min_plane_share, "in (0, 1)"),
      require(positive(min_height), "min_height", min_height, "finite and > 0 m"),
      require(max_height > min_height && std::isfinite(max_height), "max_height", max_height, "finite and > min_height m"),
      require(positive(flood_step), "flood_step", flood_step, "finite and > 0 m"),
      require(soi_margin >= 1 && std::isfinite(soi_margin), "soi_margin", soi_margin, "finite and >= 1"),
      require(colour_neighbours >= 0, "colour_neighbours", colour_neighbours, ">= 0"),
      require(uncertain_cost >= 0 && uncertain_cost < 1, "uncertain_cost", uncertain_cost, "in [0, 1)"),
      require(smoothness >= 0 && std::isfinite(smoothness), "smoothness", smoothness, "finite and >= 0"),
  };
  for (Expected<>& check : checks) {
    if (!check) return std::move(check);
  }
  return {};
}

}  // namespace swarmfit
