// The table of kinds that are built in: a new model is a row here and a file beside this one.
#include "host/models/model_space.hpp"

#include <algorithm>
#include <array>
#include <string>

#include <fmt/format.h>

namespace swarmfit {
namespace models {
namespace {

struct Kind {
  ModelType type;
  kernels::ModelKind kernel;
  std::unique_ptr<ModelSpace> (*make)(const std::optional<DirectionPrior>&);
};

constexpr std::array kKinds{
    Kind{ModelType::line2d, kernels::ModelKind::line2d, make_line2d_space},
    Kind{ModelType::plane, kernels::ModelKind::plane, make_plane_space},
    Kind{ModelType::circle2d, kernels::ModelKind::circle2d, make_circle2d_space},
    Kind{ModelType::sphere, kernels::ModelKind::sphere, make_sphere_space},
    Kind{ModelType::cylinder, kernels::ModelKind::cylinder, make_cylinder_space},
    Kind{ModelType::homography, kernels::ModelKind::homography, make_homography_space},
    Kind{ModelType::fundamental, kernels::ModelKind::fundamental, make_fundamental_space},
};

const Kind& row(ModelType type) noexcept {
  for (const Kind& kind : kKinds) {
    if (kind.type == type) return kind;
  }
  return kKinds.back();
}

}  // namespace

void ModelSpace::from_samples(const WorkingPoints& points, std::span<const std::uint32_t> samples, std::span<Position> thetas,
                              std::span<std::uint8_t> found) const {
  const auto size = static_cast<std::size_t>(minimal_sample());
  for (std::size_t k = 0; k < found.size(); ++k) found[k] = from_sample(points, samples.subspan(k * size, size), thetas[k]) ? 1 : 0;
}

double ModelSpace::noise_variance(const WorkingPoints&, const Weighted& support, const Position&, double squares) const {
  return squares / std::max(1.0, static_cast<double>(support.index.size()) - freedom());
}

std::unique_ptr<ModelSpace> make_space(ModelType type, const std::optional<DirectionPrior>& prior) { return row(type).make(prior); }
int minimal_sample(ModelType type) {
  static const auto sizes = [] {
    std::array<int, kKinds.size()> all{};
    std::transform(kKinds.begin(), kKinds.end(), all.begin(), [](const Kind& kind) { return kind.make({})->minimal_sample(); });
    return all;
  }();
  return sizes[static_cast<std::size_t>(&row(type) - kKinds.data())];
}
kernels::ModelKind to_kernel(ModelType type) noexcept { return type == ModelType::own ? kernels::ModelKind::own : row(type).kernel; }

}  // namespace models

std::string_view name(ModelType type) noexcept { return type == ModelType::own ? "own" : kernels::traits(models::to_kernel(type)).name; }

int dimension(ModelType type) noexcept { return type == ModelType::own ? 0 : kernels::traits(models::to_kernel(type)).dimension; }

std::span<const ModelType> model_types() noexcept {
  static constexpr auto types = [] {
    std::array<ModelType, models::kKinds.size()> all{};
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = models::kKinds[i].type;
    return all;
  }();
  return types;
}

Expected<ModelType> model_type(std::string_view wanted) {
  std::string known;
  for (const ModelType type : model_types()) {
    if (name(type) == wanted) return type;
    known += (known.empty() ? "" : ", ") + std::string(name(type));
  }
  return fail(Error::Kind::invalid_option, fmt::format("model is '{}', must be one of: {}", wanted, known));
}

Expected<std::vector<ModelType>> model_types(std::string_view names) {
  std::vector<ModelType> types;
  for (std::size_t start = 0; start <= names.size();) {
    const std::size_t comma = std::min(names.find(',', start), names.size());
    const auto type = model_type(names.substr(start, comma - start));
    if (!type) return tl::unexpected(type.error());
    types.push_back(*type);
    start = comma + 1;
  }
  return types;
}

}  // namespace swarmfit
