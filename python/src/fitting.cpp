#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <swarmfit/fit.hpp>
#include <swarmfit/report.hpp>

#include "python/src/bindings.hpp"
#include "python/src/buffers.hpp"
#include "python/src/errors.hpp"
#include "python/src/fit_result.hpp"
#include "python/src/job.hpp"
#include "python/src/options.hpp"
#include "python/src/tool.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace swarmfit::python {
namespace {

using Workshop = Tool<Fitter>;

Job<FitResult>::Work work(Fitter& fitter, const PointsView& points, std::vector<Model> warm_start) {
  return [&fitter, points, warm_start = std::move(warm_start)](const ModelCallback& on_model, std::stop_token stop) {
    return fitter.fit(points, on_model, std::move(stop), warm_start);
  };
}

FitResult fit_to_end(std::shared_ptr<Workshop> workshop, nb::handle points, nb::handle on_model, std::vector<Model> warm_start,
                     SearchRecord* record) {
  const Shift shift(std::move(workshop), "Fitter");
  const Buffer buffer(points);
  auto job = work(shift.tool(), points_view(buffer), std::move(warm_start));
  return value_of(run_to_end<FitResult>(recorded<FitResult>(shift.tool(), record, std::move(job)), on_model));
}

/// Models one by one while the search for the next goes on.
class ModelStream {
 public:
  ModelStream(std::shared_ptr<Workshop> workshop, nb::handle points, std::vector<Model> warm_start)
      : shift_(std::move(workshop), "Fitter"),
        buffer_(points),
        job_(work(shift_.tool(), points_view(buffer_), std::move(warm_start)), Job<FitResult>::Pace::runs_ahead) {}

  Model next() {
    auto model = job_.next();
    if (!model) {
      result();  // an error is raised here, too
      throw nb::stop_iteration();
    }
    return std::move(*model);
  }
  void stop() { job_.stop(); }
  const FitResult& result() {
    if (!result_) result_.emplace(job_.result());
    if (!*result_) raise(result_->error());
    return **result_;
  }

 private:
  Shift<Fitter> shift_;
  Buffer buffer_;
  std::optional<Expected<FitResult>> result_;
  Job<FitResult> job_;  // last: it uses all of the above
};

nb::frozen<std::uint16_t> labels(nb::handle self) {
  const auto& all = nb::cast<const FitResult&>(self).labels;
  return view_of(all.data(), {all.size()}, self);
}

}  // namespace

nb::dict figures(const FitResult& result) {
  nb::dict all;
  all["backend"] = result.backend.name;
  all["device"] = result.backend.device;
  all["backend_reason"] = result.backend.reason;
  all["seed"] = result.seed;
  all["threshold"] = result.threshold;
  all["stop_reason"] = result.stop_reason;
  all["finite_points"] = result.finite_points;
  all["iterations"] = result.iterations;
  all["evaluations"] = result.evaluations;
  all["points_touched"] = result.points_touched;
  all["total_ms"] = result.total_ms;
  return all;
}

void bind_fitting(nb::module_& module) {
  nb::class_<FitResult>(module, "FitResult")
      .def_prop_ro("models", &model_list)
      .def_prop_ro("labels", &labels)
      .def_prop_ro("figures", &figures)
      .def("brief", &FitResult::brief);
  nb::class_<ModelStream>(module, "ModelStream")
      .def("__iter__", [](nb::handle self) { return nb::borrow(self); })
      .def("__next__", &ModelStream::next)
      .def("stop", &ModelStream::stop)
      .def("result", &ModelStream::result, nb::rv_policy::reference_internal);
  nb::class_<Workshop>(module, "Fitter")
      .def(nb::new_([](const nb::kwargs& options) { return make_tool<Fitter>(fit_options(options)); }))
      .def("fit", &fit_to_end, "points"_a, "on_model"_a = nb::none(), "warm_start"_a = std::vector<Model>(), "record"_a = nb::none())
      .def(
          "find_models",
          [](std::shared_ptr<Workshop> self, nb::handle points, std::vector<Model> warm_start) {
            return std::make_unique<ModelStream>(std::move(self), points, std::move(warm_start));
          },
          "points"_a, "warm_start"_a = std::vector<Model>())
      .def_prop_ro("backend", [](const Workshop& self) {
        const BackendInfo info = self.tool.backend();
        return nb::make_tuple(info.name, info.device, info.reason);
      });
}

}  // namespace swarmfit::python
