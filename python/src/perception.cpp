#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <swarmfit/perception.hpp>
#include <swarmfit/report.hpp>
#include <swarmfit/results.hpp>

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

using Eye = Tool<Perceiver>;

PerceiveResult perceive(std::shared_ptr<Eye> eye, const Cloud& frame, nb::handle on_plane, SearchRecord* record) {
  const Shift shift(std::move(eye), "Perceiver");
  return value_of(run_to_end<PerceiveResult>(recorded<PerceiveResult>(shift.tool(), record,
                                                                      [&](const ModelCallback& on_model, std::stop_token stop) {
                                                                        return shift.tool().perceive(frame, on_model, std::move(stop));
                                                                      }),
                                             on_plane));
}

nb::frozen<double> vector_of(const Eigen::Vector3d& v, nb::handle owner) { return view_of(v.data(), {3}, owner); }

nb::frozen<std::uint16_t> popout(nb::handle self) {
  const auto& all = nb::cast<const PerceiveResult&>(self).popout;
  return view_of(all.data(), {all.size()}, self);
}

nb::object objects(nb::handle self) {
  const auto& all = nb::cast<const PerceiveResult&>(self).objects;
  return all.empty() ? nb::none() : nb::cast(view_of(all.data(), {all.size()}, self));
}

nb::frozen<std::uint16_t> labels(nb::handle self) {
  const auto& all = nb::cast<const PerceiveResult&>(self).fit.labels;
  return view_of(all.data(), {all.size()}, self);
}

nb::dict timing(const PerceiveResult& result) {
  nb::dict all;
  all["total"] = result.timing_ms.total;
  all["fit"] = result.timing_ms.fit;
  all["popout"] = result.timing_ms.popout;
  all["segment"] = result.timing_ms.segment;
  all["recognise"] = result.timing_ms.recognise;
  return all;
}

nb::list sois(const PerceiveResult& result) {
  nb::list all;
  for (const SpaceOfInterest& soi : result.sois) all.append(nb::cast(soi));
  return all;
}

nb::list recognised(const SpaceOfInterest& soi) {
  nb::list all;
  for (const Recognition& r : soi.recognised) all.append(nb::make_tuple(r.name, r.inliers, r.score));
  return all;
}

nb::object overlay(const PerceiveResult& result, const Cloud& cloud) {
  if (!cloud.organised()) raise({Error::Kind::bad_input, "the cloud has no image grid, must have one to be drawn on"});
  auto* pixels = new std::vector<std::uint8_t>;
  const nb::capsule owner(pixels, [](void* p) noexcept { delete static_cast<std::vector<std::uint8_t>*>(p); });
  {
    const nb::gil_scoped_release unlocked;
    *pixels = render_overlay(result, cloud);
  }
  using Image = nb::ndarray<nb::numpy, std::uint8_t>;
  const std::size_t shape[] = {static_cast<std::size_t>(cloud.height), static_cast<std::size_t>(cloud.width), 3};
  return nb::cast(Image(pixels->data(), 3, shape, owner));
}

}  // namespace

void bind_perception(nb::module_& module) {
  nb::class_<SpaceOfInterest>(module, "SpaceOfInterest", "A group of points above a supporting plane and the sphere around it.")
      .def_prop_ro("centre", [](nb::handle self) { return vector_of(nb::cast<const SpaceOfInterest&>(self).centre, self); })
      .def_ro("radius", &SpaceOfInterest::radius)
      .def_ro("points", &SpaceOfInterest::points)
      .def_ro("plane", &SpaceOfInterest::plane)
      .def_ro("id", &SpaceOfInterest::id)
      .def_prop_ro("bbox", [](const SpaceOfInterest& s) { return nb::make_tuple(s.bbox[0], s.bbox[1], s.bbox[2], s.bbox[3]); })
      .def_prop_ro("recognised", &recognised)
      .def("__repr__", [](const SpaceOfInterest& s) {
        char text[160];
        std::snprintf(text, sizeof text, "SpaceOfInterest(centre=[%.3f, %.3f, %.3f], radius=%.3f, points=%zu, plane=%d)", s.centre.x(),
                      s.centre.y(), s.centre.z(), s.radius, s.points, s.plane);
        return std::string(text);
      });
  nb::class_<PerceiveResult>(module, "PerceiveResult")
      .def_prop_ro("models", [](const PerceiveResult& r) { return model_list(r.fit); })
      .def_prop_ro("labels", &labels)
      .def_prop_ro("figures", [](const PerceiveResult& r) { return figures(r.fit); })
      .def_prop_ro("timing_ms", &timing)
      .def_prop_ro("up", [](nb::handle self) { return vector_of(nb::cast<const PerceiveResult&>(self).up, self); })
      .def_ro("vertical_source", &PerceiveResult::vertical_source)
      .def_prop_ro("sois", &sois)
      .def_prop_ro("popout", &popout)
      .def_prop_ro("objects", &objects)
      .def("overlay", &overlay, "cloud"_a)
      .def(
          "to_json", [](const PerceiveResult& r, const Cloud& cloud) { return to_json(r, cloud); }, "cloud"_a)
      .def(
          "write",
          [](const PerceiveResult& r, const std::filesystem::path& folder, const Cloud& cloud) {
            Expected<> written;
            {
              const nb::gil_scoped_release unlocked;
              written = write_perception(folder, r, cloud);
            }
            value_of(std::move(written));
          },
          "folder"_a, "cloud"_a);
  nb::class_<Eye>(module, "Perceiver")
      .def(nb::new_([](const nb::kwargs& options) { return make_tool<Perceiver>(perceive_options(options)); }))
      .def("perceive", &perceive, "cloud"_a, "on_plane"_a = nb::none(), "record"_a = nb::none());
  module.attr("UNCERTAIN") = kUncertain;
}

}  // namespace swarmfit::python
