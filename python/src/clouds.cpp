#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <swarmfit/cloud.hpp>
#include <swarmfit/images.hpp>
#include <swarmfit/scene.hpp>

#include "python/src/bindings.hpp"
#include "python/src/buffers.hpp"
#include "python/src/errors.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace swarmfit::python {
namespace {

using Camera = std::tuple<double, double, double, double>;
using Path = std::filesystem::path;

Intrinsics intrinsics_of(const Camera& k) { return {std::get<0>(k), std::get<1>(k), std::get<2>(k), std::get<3>(k)}; }

/// Reading and making takes a while: let other threads of Python run.
template <class Make>
Cloud without_lock(const Make& make) {
  std::optional<Expected<Cloud>> made;
  {
    const nb::gil_scoped_release unlocked;
    made.emplace(make());
  }
  return value_of(std::move(*made));
}

/// The grid's or the list's shape, and `columns` more.
nb::object shaped(const auto& values, std::size_t columns, const Cloud& cloud, nb::handle owner) {
  const auto rows = cloud.organised() ? static_cast<std::size_t>(cloud.height) : cloud.size();
  if (!cloud.organised()) return nb::cast(view_of(values.data(), {rows, columns}, owner));
  return nb::cast(view_of(values.data(), {rows, static_cast<std::size_t>(cloud.width), columns}, owner));
}

nb::object points(nb::handle self) {
  const auto& cloud = nb::cast<const Cloud&>(self);
  const auto columns = static_cast<std::size_t>(cloud.dimension);
  return cloud.values64.empty() ? shaped(cloud.values32, columns, cloud, self) : shaped(cloud.values64, columns, cloud, self);
}

nb::object colours(nb::handle self) {
  const auto& cloud = nb::cast<const Cloud&>(self);
  return cloud.coloured() ? shaped(cloud.rgb, 3, cloud, self) : nb::none();
}

std::optional<Camera> camera(const Cloud& cloud) {
  if (!cloud.intrinsics) return std::nullopt;
  return Camera(cloud.intrinsics->fx, cloud.intrinsics->fy, cloud.intrinsics->cx, cloud.intrinsics->cy);
}

template <class Scalar>
std::vector<Scalar> copy_rows(const PointsView& view) {
  const std::size_t bytes = sizeof(Scalar) * static_cast<std::size_t>(view.dimension());
  std::vector<Scalar> values(view.size() * static_cast<std::size_t>(view.dimension()));
  auto* to = reinterpret_cast<char*>(values.data());
  const auto* from = static_cast<const char*>(view.data());
  for (std::size_t i = 0; i < view.size(); ++i, to += bytes, from += view.stride()) std::memcpy(to, from, bytes);
  return values;
}

/// A copy of arrays that the package's Python half has looked at.
Cloud from_arrays(nb::handle rows, int width, int height, nb::handle rgb, const std::optional<Camera>& k) {
  const Buffer buffer(rows);
  const PointsView view = points_view(buffer);
  Cloud cloud;
  cloud.dimension = view.dimension();
  cloud.width = width;
  cloud.height = height;
  if (k) cloud.intrinsics = intrinsics_of(*k);
  if (view.scalar() == PointsView::Scalar::float32) {
    cloud.values32 = copy_rows<float>(view);
  } else {
    cloud.values64 = copy_rows<double>(view);
  }
  if (!rgb.is_none()) {
    const Buffer colour(rgb);
    if (!colour.holds('B') || colour.dimensions() != 2 || colour.extent(0) != view.size() || colour.extent(1) != 3 || colour.step(1) != 1 ||
        colour.step(0) != 3) {
      throw nb::type_error("rgb must be a contiguous N x 3 array of uint8");
    }
    const auto* bytes = static_cast<const std::uint8_t*>(colour.data());
    cloud.rgb.assign(bytes, bytes + 3 * view.size());
  }
  return cloud;
}

Cloud from_depth(nb::handle depth, const Camera& k, double depth_scale, nb::handle rgb) {
  const Buffer z(depth);
  const bool whole = z.holds('H');
  if ((!whole && !z.holds('f')) || z.dimensions() != 2 || z.step(1) != (whole ? 2 : 4) || z.step(0) < 0) {
    throw nb::type_error("depth must be an H x W array of uint16 or float32 with adjacent columns");
  }
  const DepthView view{z.data(), whole ? DepthView::Scalar::uint16 : DepthView::Scalar::float32, static_cast<int>(z.extent(1)),
                       static_cast<int>(z.extent(0)), static_cast<std::size_t>(z.step(0))};
  std::optional<Buffer> pixels;
  ColourView colour;
  if (!rgb.is_none()) {
    pixels.emplace(rgb);
    if (!pixels->holds('B') || pixels->dimensions() != 3 || pixels->extent(2) != 3 || pixels->step(2) != 1 || pixels->step(1) != 3 ||
        pixels->step(0) < 0) {
      throw nb::type_error("color must be an H x W x 3 array of uint8 with adjacent pixels");
    }
    colour = {pixels->data(), ColourView::Order::rgb, static_cast<int>(pixels->extent(1)), static_cast<int>(pixels->extent(0)),
              static_cast<std::size_t>(pixels->step(0))};
  }
  return without_lock([&] { return make_cloud(view, intrinsics_of(k), depth_scale, colour); });
}

std::string shown(const Cloud& cloud) {
  std::string text = "Cloud of " + std::to_string(cloud.size()) + " points";
  if (cloud.organised()) text += ", " + std::to_string(cloud.width) + " x " + std::to_string(cloud.height);
  return text + (cloud.coloured() ? ", coloured" : "");
}

}  // namespace

void bind_clouds(nb::module_& module) {
  nb::class_<Cloud>(module, "Cloud", "Points in input order, perhaps on an image grid, perhaps with colour.")
      .def_prop_ro("points", &points)
      .def_prop_ro("rgb", &colours)
      .def_ro("width", &Cloud::width)
      .def_ro("height", &Cloud::height)
      .def_prop_ro("organised", &Cloud::organised)
      .def_prop_ro("intrinsics", &camera)
      .def("__len__", &Cloud::size)
      .def("__repr__", &shown);
  module.def("cloud_from_arrays", &from_arrays, "points"_a, "width"_a, "height"_a, "rgb"_a = nb::none(), "intrinsics"_a = nb::none());
  module.def("cloud_from_depth", &from_depth, "depth"_a, "intrinsics"_a, "depth_scale"_a, "rgb"_a = nb::none());
  module.def(
      "read_cloud", [](const Path& file) { return without_lock([&] { return read_cloud(file); }); }, "file"_a);
  module.def(
      "read_depth",
      [](const Path& depth, const Camera& k, double scale) {
        return without_lock([&] { return read_depth(depth, intrinsics_of(k), scale); });
      },
      "depth"_a, "intrinsics"_a, "depth_scale"_a = 0.001);
  module.def(
      "read_rgbd",
      [](const Path& color, const Path& depth, const Camera& k, double scale) {
        return without_lock([&] { return read_rgbd(color, depth, intrinsics_of(k), scale); });
      },
      "color"_a, "depth"_a, "intrinsics"_a, "depth_scale"_a = 0.001);
  module.def(
      "read_stereo",
      [](const Path& left, const Path& right, const Path& calib) { return without_lock([&] { return read_stereo(left, right, calib); }); },
      "left"_a, "right"_a, "calib"_a);
  module.def(
      "make_room_scene",
      [](std::uint64_t seed, int width, int height, std::size_t frame, std::size_t frames) {
        if (width < 1 || height < 1) raise({Error::Kind::invalid_option, "width and height must be >= 1 [px]"});
        if (frame >= frames) {
          raise(
              {Error::Kind::invalid_option, "frame is " + std::to_string(frame) + ", must be less than frames, " + std::to_string(frames)});
        }
        return without_lock([&]() -> Expected<Cloud> { return make_room_scene(seed, width, height, walk_in_room(frame, frames)).cloud; });
      },
      "seed"_a = 1, "width"_a = 640, "height"_a = 480, "frame"_a = 0, "frames"_a = 1);
}

}  // namespace swarmfit::python
