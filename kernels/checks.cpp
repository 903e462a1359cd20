#include "kernels/checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace swarmfit::kernels {
namespace {

constexpr std::size_t kMaxPoints = (std::size_t{1} << 31) - 1;
constexpr std::size_t kMaxModels = 65534;

tl::unexpected<Failure> invalid(std::string message) { return fail(Failure::Kind::invalid, std::move(message)); }

/// The traits of a kind that the evaluator has and points of this dimension can be fitted by.
Result<ModelTraits> check_kind(ModelKind kind, int dimension, const OwnModel* own) {
  if (kind == ModelKind::own && own == nullptr) return invalid("the model's kind is own, must be one that is built in");
  if (kind != ModelKind::own && own != nullptr) {
    return invalid(fmt::format("the model's kind is {}, must be own: the evaluator was made for {}", traits(kind).name, own->name));
  }
  const ModelTraits t = own != nullptr ? own->traits() : traits(kind);
  if (t.dimension != dimension) {
    return invalid(fmt::format("{} is fitted to points of dimension {}, but points.dimension is {}", t.name, t.dimension, dimension));
  }
  return t;
}

}  // namespace

Result<> check_points(const PointsView& points) {
  if (points.dimension < 2 || points.dimension > kMaxDimension) {
    return invalid(fmt::format("points.dimension is {}, must be 2, 3 or 4", points.dimension));
  }
  if (points.count > kMaxPoints) return invalid(fmt::format("points.count is {}, must be <= {}", points.count, kMaxPoints));
  if (points.count > 0 && points.data == nullptr) return invalid("points.data is null, must not be");
  return {};
}

Result<> check_caps(std::span<const float> caps, std::span<const std::uint8_t> finite) {
  if (auto size = check_size("caps.size()", caps.size(), finite.size()); !size) return size;
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (finite[i] && !(caps[i] >= 0 && caps[i] <= std::numeric_limits<float>::max())) {
      return invalid(fmt::format("caps[{}] is {}, must be finite and >= 0", i, caps[i]));
    }
  }
  return {};
}

Result<> check_size(const char* field, std::size_t value, std::size_t wanted) {
  if (value != wanted) return invalid(fmt::format("{} is {}, must be {}", field, value, wanted));
  return {};
}

Result<> check_model(const ModelView& model, int dimension, const OwnModel* own) {
  const auto t = check_kind(model.kind, dimension, own);
  if (!t) return tl::unexpected(t.error());
  return check_size("model.parameters.size()", model.parameters.size(), static_cast<std::size_t>(t->parameter_count));
}

Result<> check_swarm(const SwarmView& swarm, int dimension, std::span<const float> cutoffs, std::span<const float> costs,
                     const OwnModel* own) {
  const auto t = check_kind(swarm.kind, dimension, own);
  if (!t) return tl::unexpected(t.error());
  const std::size_t wanted = swarm.count * static_cast<std::size_t>(t->parameter_count);
  if (auto size = check_size("swarm.parameters.size()", swarm.parameters.size(), wanted); !size) return size;
  if (auto size = check_size("costs.size()", costs.size(), swarm.count); !size) return size;
  if (!cutoffs.empty()) return check_size("cutoffs.size()", cutoffs.size(), swarm.count);
  return {};
}

Result<> check_assign(std::span<const ModelView> models, int dimension, std::size_t points, std::span<const float> tolerance,
                      std::span<const std::uint16_t> labels, const OwnModel* own) {
  if (models.size() > kMaxModels) return invalid(fmt::format("models.size() is {}, must be <= {}", models.size(), kMaxModels));
  for (const ModelView& model : models) {
    if (auto ok = check_model(model, dimension, own); !ok) return ok;
  }
  if (auto size = check_size("labels.size()", labels.size(), points); !size) return size;
  if (tolerance.size() != 1) {
    if (auto size = check_size("tolerance.size()", tolerance.size(), points); !size) return size;
  }
  for (std::size_t i = 0; i < tolerance.size(); ++i) {
    if (!(tolerance[i] >= 0)) return invalid(fmt::format("tolerance[{}] is {}, must be >= 0", i, tolerance[i]));
  }
  return {};
}

Result<> check_weigh(const PointsView& points, const Weighing& how, std::span<const ModelView> models, std::span<const float> distances,
                     std::span<const Evidence> evidence, const OwnModel* own) {
  if (auto ok = check_points(points); !ok) return ok;
  if (!(how.tolerance > 0 && std::isfinite(how.tolerance))) {
    return invalid(fmt::format("how.tolerance is {}, must be finite and > 0", how.tolerance));
  }
  if (!(how.corner > 0 && how.corner <= 1)) return invalid(fmt::format("how.corner is {}, must be in (0, 1]", how.corner));
  if (!how.caps.empty()) {
    if (auto size = check_size("how.caps.size()", how.caps.size(), points.count); !size) return size;
  }
  for (const ModelView& model : models) {
    if (auto ok = check_model(model, points.dimension, own); !ok) return ok;
  }
  if (!distances.empty()) {
    if (auto size = check_size("distances.size()", distances.size(), models.size() * points.count); !size) return size;
  }
  if (evidence.empty() && !distances.empty()) return {};  // nobody asks for more
  return check_size("evidence.size()", evidence.size(), models.size());
}

Result<> check_claim(const PointsView& points, std::span<const float> tolerance, std::span<const ModelView> models,
                     std::span<const std::uint16_t> labels, std::span<const Evidence> evidence, const OwnModel* own) {
  if (auto ok = check_points(points); !ok) return ok;
  if (auto ok = check_assign(models, points.dimension, points.count, tolerance, labels, own); !ok) return ok;
  return check_size("evidence.size()", evidence.size(), models.size());
}

Extent measure(const PointsView& points) {
  Extent extent;
  extent.finite.resize(points.count);
  double low[kMaxDimension], high[kMaxDimension];
  std::fill(low, low + kMaxDimension, std::numeric_limits<double>::infinity());
  std::fill(high, high + kMaxDimension, -std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < points.count; ++i) {
    if (!points.finite(i)) continue;
    extent.finite[i] = 1;
    ++extent.finite_count;
    for (int d = 0; d < points.dimension; ++d) {
      const double v = points.at(i, d);
      low[d] = std::min(low[d], v);
      high[d] = std::max(high[d], v);
    }
  }
  for (int d = 0; extent.finite_count > 0 && d < points.dimension; ++d) extent.centre[d] = low[d] / 2 + high[d] / 2;
  return extent;
}

}  // namespace swarmfit::kernels
