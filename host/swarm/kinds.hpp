// The kinds of model that a fit looks for.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <swarmfit/fit.hpp>

#include "host/models/model_space.hpp"
#include "host/swarm/settings.hpp"

namespace swarmfit::swarm {

struct Kind {
  std::unique_ptr<const models::ModelSpace> space;
  Settings settings;    ///< once resolved
  bool hidden = false;  ///< not asked for; it only takes from the curved ones what is not theirs
};

/// A model that a search is given to begin with.
struct Known {
  std::size_t kind = 0;        ///< among those asked for
  models::Position theta;      ///< in the frame of the points
  std::size_t iterations = 0;  ///< that it took to find
};

/// Those asked for, in that order, and behind them those that curved kinds are held against, where they were not asked for: in space the
/// other curved ones, and last the flat one.
std::vector<Kind> make_kinds(const FitOptions& options);
/// Fills their settings in; as resolve() of one.
void resolve(std::vector<Kind>& kinds, const FitOptions& options, std::size_t finite_points, double threshold);

/// Which of the kinds a model that was found among them is of.
std::size_t place_of(const models::Placed& model, std::span<const Kind> kinds);

/// A circle, a sphere or a cylinder: with a large radius it is a line or a plane for all that the data can tell.
bool is_curved(ModelType type) noexcept;
/// What it is then.
ModelType flat_of(ModelType type) noexcept;

}  // namespace swarmfit::swarm
