#include "python/src/options.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>

#include "python/src/errors.hpp"

namespace nb = nanobind;

namespace swarmfit::python {
namespace {

std::string shown(nb::handle value) { return nb::cast<std::string>(nb::repr(value)); }

[[noreturn]] void refuse(std::string_view field, nb::handle value, std::string_view bound) {
  raise({Error::Kind::invalid_option, std::string(field) + " is " + shown(value) + ", must be " + std::string(bound)});
}

template <class T>
T number(std::string_view field, nb::handle value) {
  const auto type_error = [&] {
    return nb::type_error(
        (std::string(field) + " is " + shown(value) + ", must be a " + (std::is_integral_v<T> ? "whole number" : "number")).c_str());
  };
  if (PyBool_Check(value.ptr())) throw type_error();
  if constexpr (std::is_integral_v<T>) {
    const nb::object whole = nb::steal(PyNumber_Index(value.ptr()));
    if (!whole.is_valid()) {
      PyErr_Clear();
      throw type_error();
    }
    T result{};
    if (nb::try_cast(whole, result)) return result;
    refuse(field, value, std::is_unsigned_v<T> ? "a whole number >= 0" : "a whole number of 32 bits");
  } else {
    const double result = PyFloat_AsDouble(value.ptr());
    if (result == -1 && PyErr_Occurred()) {
      PyErr_Clear();
      throw type_error();
    }
    return result;
  }
}

std::string text(std::string_view field, nb::handle value) {
  if (!nb::isinstance<nb::str>(value)) throw nb::type_error((std::string(field) + " is " + shown(value) + ", must be a str").c_str());
  return nb::cast<std::string>(value);
}

std::filesystem::path path(nb::handle value) { return nb::cast<std::filesystem::path>(value); }

/// Sets one field if the name is one of FitOptions'.
bool set(FitOptions& o, std::string_view name, nb::handle value) {
  const auto whole = [&](auto& field) { field = number<int>(name, value); };
  if (name == "model") {
    const auto kinds = value_of(model_types(text(name, value)));
    o.model = kinds.front();
    o.rivals.assign(kinds.begin() + 1, kinds.end());
  } else if (name == "threshold") {
    if (nb::isinstance<nb::str>(value)) {
      if (text(name, value) != "auto") refuse(name, value, "a number > 0 or 'auto'");
      o.estimate_threshold = true;
    } else {
      o.threshold = number<double>(name, value);
    }
  } else if (name == "preset") {
    const std::string given = text(name, value);
    if (given != "fast" && given != "paper") refuse(name, value, "'fast' or 'paper'");
    o.preset = given == "fast" ? Preset::fast : Preset::paper;
  } else if (name == "noise") {
    const std::string given = text(name, value);
    if (given != "none" && given != "depth") refuse(name, value, "'none' or 'depth'");
    o.noise = given == "depth" ? Noise::depth : Noise::none;
  } else if (name == "deflation") {
    const std::string given = text(name, value);
    if (given != "residual" && given != "parametric") refuse(name, value, "'residual' or 'parametric'");
    o.deflation = given == "residual" ? Deflation::residual : Deflation::parametric;
  } else if (name == "loss") {
    const std::string given = text(name, value);
    if (given != "truncated_l1" && given != "truncated_l2") refuse(name, value, "'truncated_l1' or 'truncated_l2'");
    o.loss = given == "truncated_l1" ? Loss::truncated_l1 : Loss::truncated_l2;
  } else if (name == "direction") {
    if (!nb::isinstance<nb::sequence>(value) || nb::len(value) != 2) refuse(name, value, "a pair: axis (3 numbers), angle [rad]");
    o.prior = DirectionPrior{vector3(nb::object(value[0]), "direction's axis"), number<double>("direction's angle", nb::object(value[1]))};
  } else if (name == "particles") {
    whole(o.particles);
  } else if (name == "iterations") {
    whole(o.iterations);
  } else if (name == "stall") {
    whole(o.stall);
  } else if (name == "threads") {
    whole(o.threads);
  } else if (name == "lambda_") {
    o.lambda = number<double>(name, value);
  } else if (name == "min_inliers") {
    o.min_inliers = number<std::size_t>(name, value);
  } else if (name == "max_models") {
    o.max_models = number<std::size_t>(name, value);
  } else if (name == "time_budget_ms") {
    o.time_budget_ms = number<double>(name, value);
  } else if (name == "seed") {
    o.seed = number<std::uint64_t>(name, value);
  } else if (name == "backend") {
    o.backend = text(name, value);
  } else if (name == "pipeline_cache") {
    o.pipeline_cache = path(value).string();
  } else {
    return false;
  }
  return true;
}

bool set(PerceiveOptions& o, std::string_view name, nb::handle value) {
  const auto real = [&](auto& field) { field = number<double>(name, value); };
  if (name == "gravity") {
    o.gravity = vector3(value, "gravity");
  } else if (name == "camera_tilt") {
    real(o.camera_tilt);
  } else if (name == "horizontal_angle") {
    real(o.horizontal_angle);
  } else if (name == "min_plane_share") {
    real(o.min_plane_share);
  } else if (name == "min_height") {
    real(o.min_height);
  } else if (name == "max_height") {
    real(o.max_height);
  } else if (name == "flood_step") {
    real(o.flood_step);
  } else if (name == "min_soi_points") {
    o.min_soi_points = number<std::size_t>(name, value);
  } else if (name == "soi_margin") {
    real(o.soi_margin);
  } else if (name == "segmentation") {
    const std::string given = text(name, value);
    if (given != "graphcut" && given != "fixation") refuse(name, value, "'graphcut' or 'fixation'");
    o.segmentation = given == "graphcut" ? Segmentation::graphcut : Segmentation::fixation;
  } else if (name == "colour_neighbours") {
    o.colour_neighbours = number<int>(name, value);
  } else if (name == "uncertain_cost") {
    real(o.uncertain_cost);
  } else if (name == "smoothness") {
    real(o.smoothness);
  } else if (name == "gallery") {
    o.gallery = path(value);
  } else if (name == "track") {
    if (!PyBool_Check(value.ptr())) throw nb::type_error(("track is " + shown(value) + ", must be True or False").c_str());
    o.track = value.is(nb::handle(Py_True));
  } else {
    return name != "model" && set(o.fit, name, value);
  }
  return true;
}

template <class Options>
Options checked(const nb::kwargs& given) {
  Options options;
  for (const auto& [key, value] : given) {
    const std::string name = nb::cast<std::string>(key);
    if (value.is_none()) continue;
    if (!set(options, name, value)) throw nb::type_error(("unknown option '" + name + "'").c_str());
  }
  value_of(options.validate());
  return options;
}

}  // namespace

Eigen::Vector3d vector3(nb::handle value, const char* field) {
  if (!PySequence_Check(value.ptr()) || nb::len(value) != 3) refuse(field, value, "3 numbers");
  Eigen::Vector3d vector;
  for (Py_ssize_t i = 0; i < 3; ++i) {
    const nb::object item = nb::steal(PySequence_GetItem(value.ptr(), i));
    if (!item.is_valid()) throw nb::python_error();
    vector[i] = number<double>(field, item);
  }
  return vector;
}

std::size_t count(nb::handle value, const char* field) { return number<std::size_t>(field, value); }

FitOptions fit_options(const nb::kwargs& given) { return checked<FitOptions>(given); }
PerceiveOptions perceive_options(const nb::kwargs& given) { return checked<PerceiveOptions>(given); }

}  // namespace swarmfit::python
