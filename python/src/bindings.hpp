// The compiled half of the package swarmfit: one function a file that adds to the module.
#pragma once

#include <nanobind/nanobind.h>

namespace swarmfit::python {

void bind_errors(nanobind::module_& module);
void bind_models(nanobind::module_& module);
void bind_clouds(nanobind::module_& module);
void bind_fitting(nanobind::module_& module);
void bind_perception(nanobind::module_& module);
void bind_reporting(nanobind::module_& module);
void bind_machine(nanobind::module_& module);

}  // namespace swarmfit::python
