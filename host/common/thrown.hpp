// Where exceptions end: what the library's own code throws becomes an Error, what a caller's function throws goes back to the caller.
#pragma once

#include <exception>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include <swarmfit/error.hpp>

namespace swarmfit::common {

/// What a caller's own function threw, on its way past the handlers of the library.
struct CallersException {
  std::exception_ptr thrown;
};

/// The same function, but that what it throws goes by as a CallersException; empty if it is empty. `call` must outlive what comes of it.
template <class Result, class... Args>
std::function<Result(Args...)> going_by(const std::function<Result(Args...)>& call) {
  if (!call) return {};
  return [&call](Args... args) -> Result {
    try {
      return call(std::forward<Args>(args)...);
    } catch (...) {
      throw CallersException{std::current_exception()};
    }
  };
}

/// out_of_memory, in the words of `say()`, or in fewer where there is no memory for them either.
template <class Say>
Error no_memory(Say&& say) {
  Error error{Error::Kind::out_of_memory, "no memory"};  // short enough to need none
  try {
    error.message = say();
  } catch (const std::bad_alloc&) {
  }
  return error;
}

/// For a handler: the Error that the exception at hand is. Memory or threads that cannot be had: out_of_memory, in the words of `say()`;
/// else `otherwise`, in the exception's own. What a caller's function threw is thrown on as it was, and so is what is no std::exception.
template <class Say>
tl::unexpected<Error> error_of_thrown(Error::Kind otherwise, Say&& say) {
  try {
    throw;
  } catch (const CallersException& callers) {
    std::rethrow_exception(callers.thrown);
  } catch (const std::bad_alloc&) {
    return tl::unexpected(no_memory(say));
  } catch (const std::length_error&) {  // more than memory could ever hold
    return tl::unexpected(no_memory(say));
  } catch (const std::system_error& e) {
    if (e.code() != std::errc::resource_unavailable_try_again) return fail(otherwise, e.what());
    return tl::unexpected(no_memory([&] { return say() + ": a thread cannot be started"; }));
  } catch (const std::exception& e) {
    return fail(otherwise, e.what());
  }
}

}  // namespace swarmfit::common
