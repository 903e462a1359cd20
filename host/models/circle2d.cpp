#include <array>
#include <cmath>
#include <numbers>

#include "host/models/round.hpp"

namespace swarmfit::models {
namespace {

constexpr int kPlaces = 32;  // around a circle

std::array<Eigen::Vector2d, kPlaces> places_around() {
  std::array<Eigen::Vector2d, kPlaces> places;
  for (int k = 0; k < kPlaces; ++k) {
    const double angle = 2 * std::numbers::pi * k / kPlaces;
    places[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
  }
  return places;
}

class Circle2d final : public Round<2> {
 public:
  ModelType type() const noexcept override { return ModelType::circle2d; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::circle2d; }
  double length_within(const Position& theta, const Eigen::Vector2d& low, const Eigen::Vector2d& high) const override {
    static const std::array<Eigen::Vector2d, kPlaces> kAround = places_around();
    int inside = 0;
    for (const Eigen::Vector2d& place : kAround) {
      const Eigen::Vector2d p = theta.head<2>() + theta[2] * place;
      inside += (p.array() >= low.array()).all() && (p.array() <= high.array()).all() ? 1 : 0;
    }
    return 2 * std::numbers::pi * theta[2] * inside / kPlaces;
  }
};

}  // namespace

std::unique_ptr<ModelSpace> make_circle2d_space(const std::optional<DirectionPrior>&) { return std::make_unique<Circle2d>(); }

}  // namespace swarmfit::models
