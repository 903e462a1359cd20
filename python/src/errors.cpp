#include "python/src/errors.hpp"

#include <array>
#include <string>

#include "python/src/bindings.hpp"

namespace nb = nanobind;

namespace swarmfit::python {
namespace {

/// By Error::Kind, in its order. They live as long as the interpreter.
std::array<PyObject*, 5> exceptions{};

PyObject* make(nb::module_& module, const char* name, const char* doc, nb::handle bases) {
  const std::string full = std::string("swarmfit.") + name;
  PyObject* made = PyErr_NewExceptionWithDoc(full.c_str(), doc, bases.ptr(), nullptr);
  if (!made) throw nb::python_error();
  module.attr(name) = nb::handle(made);
  return made;
}

}  // namespace

void raise(const Error& error) {
  PyErr_SetString(exceptions[static_cast<std::size_t>(error.kind)], error.message.c_str());
  throw nb::python_error();
}

void bind_errors(nb::module_& module) {
  const nb::handle base =
      make(module, "Error", "What Swarmfit cannot do, in words that name the field, the value and the bound.", nb::handle(PyExc_Exception));
  const auto with = [&](PyObject* builtin) { return nb::make_tuple(base, nb::handle(builtin)); };
  const nb::object value = with(PyExc_ValueError), runtime = with(PyExc_RuntimeError);
  exceptions = {make(module, "InvalidOption", "An option is out of its bounds.", value),
                make(module, "BadInput", "Data that cannot be used: unreadable, of the wrong shape, too few.", value),
                make(module, "BackendUnavailable", "The back end or device asked for cannot be used.", runtime),
                make(module, "OutOfMemory", "Host or device memory does not hold the work.", runtime),
                make(module, "CannotWrite", "An output cannot be written.", runtime)};
}

}  // namespace swarmfit::python
