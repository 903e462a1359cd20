#include <string>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <swarmfit/model.hpp>

#include "python/src/bindings.hpp"
#include "python/src/buffers.hpp"
#include "python/src/errors.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace swarmfit::python {
namespace {

int parameter_count(ModelType type) {
  switch (type) {
    case ModelType::line2d:
    case ModelType::circle2d: return 3;
    case ModelType::plane:
    case ModelType::sphere: return 4;
    case ModelType::cylinder: return 7;
    case ModelType::homography:
    case ModelType::fundamental: return 9;
    case ModelType::own: break;  // not from Python
  }
  return 0;
}

void make(Model* self, const std::string& type, const std::vector<double>& parameters) {
  Model model;
  model.type = value_of(model_type(type));
  const auto wanted = static_cast<std::size_t>(parameter_count(model.type));
  if (parameters.size() != wanted) {
    raise({Error::Kind::bad_input,
           "parameters has " + std::to_string(parameters.size()) + " values, must have " + std::to_string(wanted) + " for a " + type});
  }
  model.parameters = Eigen::Map<const Eigen::VectorXd>(parameters.data(), static_cast<Eigen::Index>(parameters.size()));
  new (self) Model(std::move(model));
}

nb::frozen<double> part(nb::handle self, Eigen::Index first, Eigen::Index size) {
  return view_of(nb::cast<const Model&>(self).parameters.data() + first, {static_cast<std::size_t>(size)}, self);
}

[[noreturn]] void absent(const Model& model, const char* attribute) {
  throw nb::attribute_error(("a " + std::string(name(model.type)) + " has no " + attribute).c_str());
}

nb::frozen<double> parameters(nb::handle self) { return part(self, 0, nb::cast<const Model&>(self).parameters.size()); }

nb::frozen<double> covariance(nb::handle self) {
  const Eigen::MatrixXd& c = nb::cast<const Model&>(self).covariance;  // symmetric: columns are rows
  return view_of(c.data(), {static_cast<std::size_t>(c.rows()), static_cast<std::size_t>(c.cols())}, self);
}

nb::frozen<double> normal(nb::handle self) {
  const auto& m = nb::cast<const Model&>(self);
  if (m.type == ModelType::plane) return part(self, 0, 3);
  if (m.type == ModelType::line2d) return part(self, 0, 2);
  absent(m, "normal");
}

double offset(const Model& m) {
  if (m.type == ModelType::plane || m.type == ModelType::line2d) return m.offset();
  absent(m, "offset");
}

nb::frozen<double> centre(nb::handle self) {
  const auto& m = nb::cast<const Model&>(self);
  if (m.type == ModelType::sphere) return part(self, 0, 3);
  if (m.type == ModelType::circle2d) return part(self, 0, 2);
  absent(m, "centre");
}

double radius(const Model& m) {
  if (m.type == ModelType::sphere || m.type == ModelType::circle2d || m.type == ModelType::cylinder) {
    return m.parameters[m.parameters.size() - 1];
  }
  absent(m, "radius");
}

nb::frozen<double> point(nb::handle self) {
  const auto& m = nb::cast<const Model&>(self);
  if (m.type == ModelType::cylinder) return part(self, 0, 3);
  absent(m, "point");
}

nb::frozen<double> axis(nb::handle self) {
  const auto& m = nb::cast<const Model&>(self);
  if (m.type == ModelType::cylinder) return part(self, 3, 3);
  absent(m, "axis");
}

nb::frozen<double> matrix(nb::handle self) {
  const auto& m = nb::cast<const Model&>(self);
  if (m.type == ModelType::homography || m.type == ModelType::fundamental) return view_of(m.parameters.data(), {3, 3}, self);
  absent(m, "matrix");
}

std::string shown(const Model& m) {
  char number[32];
  std::string text = "Model('" + std::string(name(m.type)) + "', [";
  for (Eigen::Index i = 0; i < m.parameters.size(); ++i) {
    std::snprintf(number, sizeof number, "%s%.6g", i ? ", " : "", m.parameters[i]);
    text += number;
  }
  return text + "])" + (m.inliers ? " of " + std::to_string(m.inliers) + " points" : "");
}

}  // namespace

void bind_models(nb::module_& module) {
  nb::class_<Model>(module, "Model", "A fitted model, in the data's frame and unit. Made by hand, it can warm-start a fit.")
      .def("__init__", &make, "type"_a, "parameters"_a)
      .def_prop_ro("type", [](const Model& m) { return std::string(name(m.type)); })
      .def_prop_ro("parameters", &parameters)
      .def_prop_ro("covariance", &covariance)
      .def_prop_ro("normal", &normal)
      .def_prop_ro("offset", &offset)
      .def_prop_ro("centre", &centre)
      .def_prop_ro("radius", &radius)
      .def_prop_ro("point", &point)
      .def_prop_ro("axis", &axis)
      .def_prop_ro("matrix", &matrix)
      .def_ro("inliers", &Model::inliers)
      .def_ro("cost", &Model::cost)
      .def_ro("rms", &Model::rms)
      .def_ro("supporting", &Model::supporting)
      .def_ro("id", &Model::id)
      .def_ro("iterations", &Model::iterations)
      .def_ro("evaluations", &Model::evaluations)
      .def_ro("points_touched", &Model::points_touched)
      .def_ro("found_at_ms", &Model::found_at_ms)
      .def("__repr__", &shown);
  module.def("model_types", [] {
    std::vector<std::string> names;
    for (const ModelType type : model_types()) names.emplace_back(name(type));
    return names;
  });
  module.def(
      "dimension", [](const std::string& types) { return dimension(value_of(model_types(types)).front()); }, "type"_a);
}

}  // namespace swarmfit::python
