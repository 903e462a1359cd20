// Keyword arguments to option structs. Their names are the structs' own.
#pragma once

#include <nanobind/nanobind.h>

#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

namespace swarmfit::python {

/// Raise TypeError for a name that is unknown, InvalidOption for a value out of its bounds. None leaves the default.
FitOptions fit_options(const nanobind::kwargs& given);
PerceiveOptions perceive_options(const nanobind::kwargs& given);

/// Three numbers.
Eigen::Vector3d vector3(nanobind::handle value, const char* field);
/// A whole number >= 0.
std::size_t count(nanobind::handle value, const char* field);

}  // namespace swarmfit::python
