#include "python/src/buffers.hpp"

#include <cstring>

namespace nb = nanobind;

namespace swarmfit::python {

Buffer::Buffer(nb::handle array) {
  if (PyObject_GetBuffer(array.ptr(), &view_, PyBUF_RECORDS_RO) != 0) throw nb::python_error();
}

bool Buffer::holds(char format) const noexcept {
  const char* stored = view_.format ? view_.format : "B";
  if (*stored == '@' || *stored == '=') ++stored;
  return stored[0] == format && stored[1] == '\0';
}

PointsView points_view(const Buffer& rows) {
  const bool single = rows.holds('f');
  const auto scalar_size = static_cast<std::ptrdiff_t>(single ? sizeof(float) : sizeof(double));
  if ((!single && !rows.holds('d')) || rows.dimensions() != 2) throw nb::type_error("points must be an N x D array of float32 or float64");
  const bool adjacent = rows.extent(1) == 1 || rows.step(1) == scalar_size;
  if (!adjacent || (rows.extent(0) > 1 && rows.step(0) < 0)) throw nb::type_error("points must have adjacent columns and rows in order");
  const std::size_t stride = rows.extent(0) > 1 ? static_cast<std::size_t>(rows.step(0)) : 0;
  return {rows.data(), single ? PointsView::Scalar::float32 : PointsView::Scalar::float64, static_cast<int>(rows.extent(1)), rows.extent(0),
          stride};
}

}  // namespace swarmfit::python
