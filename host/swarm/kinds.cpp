#include "host/swarm/kinds.hpp"

#include <algorithm>

namespace swarmfit::swarm {

std::size_t place_of(const models::Placed& model, std::span<const Kind> kinds) {
  const auto at = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.space.get() == model.space; });
  return static_cast<std::size_t>(at - kinds.begin());
}

bool is_curved(ModelType type) noexcept { return type == ModelType::circle2d || type == ModelType::sphere || type == ModelType::cylinder; }

ModelType flat_of(ModelType type) noexcept { return dimension(type) == 2 ? ModelType::line2d : ModelType::plane; }

std::vector<Kind> make_kinds(const FitOptions& options) {
  const std::vector<ModelType> asked = options.kinds();
  std::vector<Kind> kinds;
  if (options.model == ModelType::own) {
    kinds.push_back({models::make_own_space(*options.own), {}, false});
    return kinds;
  }
  for (const ModelType type : asked) kinds.push_back({models::make_space(type, options.prior), {}, false});
  const ModelType flat = flat_of(options.model);
  // A flat kind with a prior leaves out what is flat and lies otherwise.
  const bool flat_asked = !options.prior && std::find(asked.begin(), asked.end(), flat) != asked.end();
  const bool doubtful = options.preset == Preset::fast && options.deflation != Deflation::parametric;
  if (!doubtful || std::none_of(asked.begin(), asked.end(), is_curved)) return kinds;
  if (dimension(options.model) == 3) {
    for (const ModelType other : {ModelType::cylinder, ModelType::sphere}) {
      if (std::find(asked.begin(), asked.end(), other) == asked.end()) kinds.push_back({models::make_space(other, {}), {}, true});
    }
  }
  if (!flat_asked) kinds.push_back({models::make_space(flat, {}), {}, true});
  return kinds;
}

void resolve(std::vector<Kind>& kinds, const FitOptions& options, std::size_t finite_points, double threshold) {
  FitOptions one = options;
  if (kinds.size() > 1) one.rivals = options.kinds();  // none of them is alone, and all see the same points
  int patience = 0;
  for (Kind& kind : kinds) {
    one.model = kind.space->type();
    kind.settings = resolve(one, finite_points, threshold);
    if (!kind.hidden) patience = std::max(patience, kind.settings.patience);
  }
  for (Kind& kind : kinds) kind.settings.patience = patience;
}

}  // namespace swarmfit::swarm
