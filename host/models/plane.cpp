#include "host/models/hyperplane.hpp"

namespace swarmfit::models {
namespace {

class Plane final : public Hyperplane<3> {
 public:
  using Hyperplane::Hyperplane;
  ModelType type() const noexcept override { return ModelType::plane; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::plane; }
  Eigen::Vector3d outward(const Position& theta, const Eigen::Vector3d&) const override { return theta.head<3>(); }
};

}  // namespace

std::unique_ptr<ModelSpace> make_plane_space(const std::optional<DirectionPrior>& prior) { return std::make_unique<Plane>(prior); }

}  // namespace swarmfit::models
