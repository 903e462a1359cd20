// Vulkan's exceptions end here.
#pragma once

#include <exception>
#include <new>
#include <string>
#include <type_traits>

#include "kernels/status.hpp"
#include "kernels/vulkan/vulkan.hpp"

namespace swarmfit::kernels::vulkan {

/// Runs `work`, which returns a Result; what it throws becomes a Failure: out_of_memory, or `otherwise`.
template <class Work>
std::invoke_result_t<Work> guarded(const char* what, Failure::Kind otherwise, Work&& work) noexcept {
  const auto failure = [what](Failure::Kind kind, const std::exception& e) {
    Failure one{kind, "vulkan failed"};  // short enough to need no memory
    try {
      one.message = std::string("vulkan: ") + what + ": " + e.what();
    } catch (const std::bad_alloc&) {
    }
    return tl::unexpected<Failure>(std::move(one));
  };
  try {
    return work();
  } catch (const vk::OutOfHostMemoryError& e) {
    return failure(Failure::Kind::out_of_memory, e);
  } catch (const vk::OutOfDeviceMemoryError& e) {
    return failure(Failure::Kind::out_of_memory, e);
  } catch (const std::bad_alloc& e) {
    return failure(Failure::Kind::out_of_memory, e);
  } catch (const std::exception& e) {
    return failure(otherwise, e);
  }
}

}  // namespace swarmfit::kernels::vulkan
