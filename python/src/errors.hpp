// Errors of the library as Python's exceptions, message for message.
#pragma once

#include <utility>

#include <nanobind/nanobind.h>

#include <swarmfit/error.hpp>

namespace swarmfit::python {

/// Needs Python's lock.
[[noreturn]] void raise(const Error& error);

/// The value, or the error raised.
template <class T>
T value_of(Expected<T>&& result) {
  if (!result) raise(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

}  // namespace swarmfit::python
