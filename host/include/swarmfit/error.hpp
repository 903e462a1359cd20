// What went wrong, in words that name the field, the value and the bound. The library never throws on purpose, prints or exits.
#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace swarmfit {

struct Error {
  enum class Kind {
    invalid_option,       ///< an option is out of its bounds                            (command line: exit code 2)
    bad_input,            ///< data that cannot be used: unreadable, truncated, too few  (exit code 3)
    backend_unavailable,  ///< the back end or device asked for cannot be used           (exit code 4)
    out_of_memory,        ///< host or device memory does not hold the work              (exit code 3)
    cannot_write,         ///< an output cannot be written                               (exit code 3)
  };
  Kind kind = Kind::invalid_option;
  std::string message;
};

/// A value or an Error. `Expected<>` holds nothing but success.
template <class T = void>
using Expected = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(Error::Kind kind, std::string message) { return tl::unexpected<Error>(Error{kind, std::move(message)}); }

}  // namespace swarmfit
