#include "host/models/hyperplane.hpp"

namespace swarmfit::models {
namespace {

class Line2d final : public Hyperplane<2> {
 public:
  using Hyperplane::Hyperplane;
  ModelType type() const noexcept override { return ModelType::line2d; }
  kernels::ModelKind kind() const noexcept override { return kernels::ModelKind::line2d; }
};

}  // namespace

std::unique_ptr<ModelSpace> make_line2d_space(const std::optional<DirectionPrior>& prior) { return std::make_unique<Line2d>(prior); }

}  // namespace swarmfit::models
