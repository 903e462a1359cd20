#include <optional>
#include <string>
#include <vector>

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <swarmfit/backend.hpp>
#include <swarmfit/bench.hpp>

#include "python/src/bindings.hpp"
#include "python/src/buffers.hpp"
#include "python/src/errors.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace swarmfit::python {
namespace {

/// A row cannot be stopped, but the rows after it can.
struct Interrupted {};

BenchReport run_bench(const BenchOptions& options, nb::handle cloud, nb::handle progress) {
  std::optional<Buffer> buffer;
  PointsView view;
  if (!cloud.is_none()) {
    buffer.emplace(cloud);
    view = points_view(*buffer);
  }
  const auto told = [&](const std::string& row) {
    const nb::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw Interrupted();
    if (progress.is_none()) return;
    const PyObject* answer = PyObject_CallFunction(progress.ptr(), "s", row.c_str());
    if (!answer) throw Interrupted();
    Py_DECREF(answer);
  };
  std::optional<Expected<BenchReport>> report;
  try {
    const nb::gil_scoped_release unlocked;
    report.emplace(bench(options, buffer ? &view : nullptr, told));
  } catch (const Interrupted&) {
    throw nb::python_error();
  }
  return value_of(std::move(*report));
}

}  // namespace

void bind_machine(nb::module_& module) {
  nb::class_<Device>(module, "Device", "One way to evaluate on this machine.")
      .def_ro("backend", &Device::backend)
      .def_ro("name", &Device::name)
      .def_ro("kind", &Device::kind)
      .def_ro("usable", &Device::usable)
      .def_ro("reason", &Device::reason)
      .def_prop_ro("limits",
                   [](const Device& device) {
                     nb::dict limits;
                     for (const auto& [name, value] : device.limits) limits[name.c_str()] = value;
                     return limits;
                   })
      .def("__repr__", [](const Device& d) {
        return d.backend + ": " + d.name + " [" + d.kind + "], " + (d.usable ? "usable" : "cannot be used") +
               (d.reason.empty() ? "" : "; " + d.reason);
      });
  module.def("devices", &devices, nb::call_guard<nb::gil_scoped_release>());

  nb::class_<BenchRow>(module, "BenchRow", "One line of a bench.")
      .def_ro("backend", &BenchRow::backend)
      .def_ro("device", &BenchRow::device)
      .def_ro("model", &BenchRow::model)
      .def_ro("points", &BenchRow::points)
      .def_ro("particles", &BenchRow::particles)
      .def_ro("pruning", &BenchRow::pruning)
      .def_ro("evaluations_per_s", &BenchRow::evaluations_per_s)
      .def_ro("fraction_of_limit", &BenchRow::fraction_of_limit)
      .def_ro("max_relative_error", &BenchRow::max_relative_error)
      .def_ro("seconds", &BenchRow::seconds);
  nb::class_<BenchReport>(module, "BenchReport", "What bench() measured.")
      .def_ro("fma_per_s", &BenchReport::fma_per_s)
      .def_ro("threads", &BenchReport::threads)
      .def_ro("rows", &BenchReport::rows)
      .def("to_json", [](const BenchReport& report) { return to_json(report); });
  module.def(
      "bench",
      [](const std::vector<std::string>& backends, const std::vector<std::string>& models, const std::vector<std::size_t>& points,
         const std::vector<std::size_t>& particles, const std::vector<bool>& pruning, int threads, double seconds, std::uint64_t seed,
         nb::handle cloud, nb::handle progress) {
        BenchOptions options;
        options.backends = backends;
        for (const std::string& name : models) options.models.push_back(value_of(model_type(name)));
        options.points = points;
        options.particles = particles;
        options.pruning = pruning;
        options.threads = threads;
        options.seconds = seconds;
        options.seed = seed;
        return run_bench(options, cloud, progress);
      },
      "backends"_a, "models"_a, "points"_a, "particles"_a, "pruning"_a, "threads"_a, "seconds"_a, "seed"_a, "cloud"_a = nb::none(),
      "progress"_a = nb::none());
}

}  // namespace swarmfit::python
