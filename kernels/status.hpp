// What a kernel answers when it cannot do what it was asked. Kernels never print, exit or read the environment.
#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace swarmfit::kernels {

struct Failure {
  enum class Kind {
    invalid,        ///< an argument is out of its bounds: field, value and bound are in the message
    unavailable,    ///< the back end or device asked for cannot be used
    out_of_memory,  ///< host or device memory does not hold the workload
    device,         ///< the device failed while working
  };
  Kind kind = Kind::invalid;
  std::string message;
};

template <class T = void>
using Result = tl::expected<T, Failure>;

inline tl::unexpected<Failure> fail(Failure::Kind kind, std::string message) {
  return tl::unexpected<Failure>(Failure{kind, std::move(message)});
}

}  // namespace swarmfit::kernels
