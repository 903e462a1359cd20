// Python's memory seen from C++, and the other way round; nothing is copied.
#pragma once

#include <cstddef>
#include <initializer_list>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <swarmfit/points.hpp>

namespace nanobind {
/// What a function gives back: a NumPy array that nobody writes to.
template <class Scalar>
using frozen = ndarray<numpy, const Scalar>;
}  // namespace nanobind

namespace swarmfit::python {

/// Holds an array's memory for as long as it lives. To be made and to go with Python's lock held.
class Buffer {
 public:
  explicit Buffer(nanobind::handle array);
  ~Buffer() { PyBuffer_Release(&view_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  const void* data() const noexcept { return view_.buf; }
  int dimensions() const noexcept { return view_.ndim; }
  std::size_t extent(int axis) const noexcept { return static_cast<std::size_t>(view_.shape[axis]); }
  std::ptrdiff_t step(int axis) const noexcept { return view_.strides[axis]; }  ///< [bytes]
  bool holds(char format) const noexcept;

 private:
  Py_buffer view_{};
};

/// N x D floats or doubles whose rows lie anywhere but whose columns are adjacent; TypeError for anything else. The package's own
/// Python half sees to it that arrays come in like this.
PointsView points_view(const Buffer& rows);

/// A view of what `owner` holds.
template <class Scalar>
nanobind::frozen<Scalar> view_of(const Scalar* data, std::initializer_list<std::size_t> shape, nanobind::handle owner) {
  return nanobind::frozen<Scalar>(data, shape.size(), shape.begin(), owner);
}

}  // namespace swarmfit::python
