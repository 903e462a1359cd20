#include "host/models/round.hpp"

namespace swarmfit::models {
namespace {

class Sphere final : public Round<3> {
 public:
  ModelType type() const noexcept override { return ModelType::sphere; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::sphere; }
  bool agrees_by_normals() const noexcept override { return true; }
  Eigen::Vector3d outward(const Position& theta, const Eigen::Vector3d& point) const override { return point - theta.head<3>(); }
};

}  // namespace

std::unique_ptr<ModelSpace> make_sphere_space(const std::optional<DirectionPrior>&) { return std::make_unique<Sphere>(); }

}  // namespace swarmfit::models
