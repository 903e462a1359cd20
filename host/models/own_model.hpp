// Own models inside the library: watched, and as kernels take them.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include <swarmfit/error.hpp>
#include <swarmfit/own_model.hpp>

#include "kernels/own/own_model.hpp"

namespace swarmfit::models {

/// What an own model's functions threw first. Nothing of it passes through the library: a residual that throws is NaN, all else is false.
class OwnWatch {
 public:
  /// `what`: an exception's words; null where it has none.
  void note(Error::Kind kind, const char* function, const char* what) noexcept;
  /// What was noted since, and forgets it.
  std::optional<Error> take();

 private:
  std::mutex mutex_;
  std::optional<Error> first_;
};

/// The same model with its functions watched.
OwnModel watched(const OwnModel& own, std::shared_ptr<OwnWatch> watch);
std::shared_ptr<const kernels::OwnModel> to_kernel(const OwnModel& own);

}  // namespace swarmfit::models
