// What a fit hands to Python. The labels stay where the library wrote them.
#pragma once

#include <nanobind/nanobind.h>

#include <swarmfit/fit.hpp>

#include "python/src/buffers.hpp"

namespace swarmfit::python {

inline nanobind::list model_list(const FitResult& result) {
  nanobind::list models;
  for (const Model& model : result.models) models.append(nanobind::cast(model));
  return models;
}

/// Figures of a fit by name: the fields of the package's Stats.
nanobind::dict figures(const FitResult& result);

}  // namespace swarmfit::python
