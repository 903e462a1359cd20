#include "python/src/bindings.hpp"

#include <swarmfit/version.hpp>

#define SWARMFIT_TEXT(value) #value
#define SWARMFIT_DOTTED(major, minor, patch) SWARMFIT_TEXT(major) "." SWARMFIT_TEXT(minor) "." SWARMFIT_TEXT(patch)

NB_MODULE(_core, module) {
  module.doc() = "Swarmfit's compiled half; the package swarmfit is the door.";
  module.attr("__version__") = SWARMFIT_DOTTED(SWARMFIT_VERSION_MAJOR, SWARMFIT_VERSION_MINOR, SWARMFIT_VERSION_PATCH);
  swarmfit::python::bind_errors(module);
  swarmfit::python::bind_models(module);
  swarmfit::python::bind_clouds(module);
  swarmfit::python::bind_fitting(module);
  swarmfit::python::bind_perception(module);
  swarmfit::python::bind_reporting(module);
  swarmfit::python::bind_machine(module);
}
