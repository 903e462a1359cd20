// What went wrong, in words that name the field, the value and the bound. The library never throws on purpose, prints or exits.
//
// What is thrown inside a call that gives an Expected becomes its Error: out_of_memory where memory, or a thread, could not be had. A
// Fitter or a Perceiver can be used again, and goes on as if the call had not been; files that were to be written are not there. An
// exception of the caller's own function (a ModelCallback, a SwarmObserver, a benchmark's progress) ends the call and comes back to the
// caller as it was thrown; those of an OwnModel's functions, which run on several threads, become the fit's error. Calls that give no
// Expected let std::bad_alloc through, and so do validate() and model_type().
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
