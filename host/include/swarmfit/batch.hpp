// Many small clouds in one call.
#pragma once

#include <span>
#include <vector>

#include <swarmfit/error.hpp>
#include <swarmfit/export.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/points.hpp>

namespace swarmfit {

/// Fits each cloud by itself, with the same options and seed: result k is that of fit(clouds[k], options), times apart, on any number of
/// threads. FitOptions::threads clouds are worked on side by side (0: as many as there are cores), each in one thread. On a Vulkan device
/// clouds of up to 16384 points go in step, and one submission scores the swarms of all that are under way; their points_touched tells
/// that nothing was pruned. Larger ones, models of one's own, and fits with a time budget go one after another there. A time budget is each
/// cloud's own. One cloud's failure (bad_input, out_of_memory) is its own, too; the whole fails with invalid_option,
/// backend_unavailable, or out_of_memory where there is none for the results.
SWARMFIT_API Expected<std::vector<Expected<FitResult>>> fit_batch(std::span<const PointsView> clouds, const FitOptions& options = {});

}  // namespace swarmfit
