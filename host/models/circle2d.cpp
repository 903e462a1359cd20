#include "host/models/round.hpp"

namespace swarmfit::models {
namespace {

class Circle2d final : public Round<2> {
 public:
  ModelType type() const noexcept override { return ModelType::circle2d; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::circle2d; }
};

}  // namespace

std::unique_ptr<ModelSpace> make_circle2d_space(const std::optional<DirectionPrior>&) { return std::make_unique<Circle2d>(); }

}  // namespace swarmfit::models
