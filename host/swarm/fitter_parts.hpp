// A fitter over an evaluator that was made elsewhere.
#pragma once

#include <memory>
#include <string>

#include <swarmfit/fit.hpp>

#include "kernels/fitness_evaluator.hpp"

namespace swarmfit {

struct FitterParts {
  /// `options` are valid and ask for no own model; `reason`: why this back end, for the results.
  static Fitter assemble(const FitOptions& options, std::unique_ptr<kernels::FitnessEvaluator> evaluator, std::string reason);
};

}  // namespace swarmfit
