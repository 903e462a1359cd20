#include "host/models/own_model.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <new>
#include <utility>

#include <fmt/format.h>

namespace swarmfit {
namespace {

Expected<> require(bool ok, const char* field, int value, const char* bound) {
  if (ok) return {};
  return fail(Error::Kind::invalid_option, fmt::format("own.{} is {}, must be {}", field, value, bound));
}

Expected<> require_given(bool given, const char* field) {
  if (given) return {};
  return fail(Error::Kind::invalid_option, fmt::format("own.{} is empty, must be given", field));
}

}  // namespace

Expected<> OwnModel::validate() const {
  Expected<> checks[] = {
      require_given(!name.empty(), "name"),
      require(dimension >= 2 && dimension <= kernels::kMaxDimension, "dimension", dimension, "2, 3 or 4"),
      require(parameter_count >= 1 && parameter_count <= kernels::kMaxParameters, "parameter_count", parameter_count, "in [1, 9]"),
      require(minimal_sample >= 1 && minimal_sample <= 8, "minimal_sample", minimal_sample, "in [1, 8]"),
      require(freedom >= 0 && freedom <= parameter_count, "freedom", freedom, "in [0, parameter_count]"),
      require_given(static_cast<bool>(residual), "residual"),
      require_given(static_cast<bool>(solve), "solve"),
  };
  for (Expected<>& check : checks) {
    if (!check) return std::move(check);
  }
  return {};
}

namespace models {

void OwnWatch::note(Error::Kind kind, const char* function, const char* what) noexcept {
  const std::lock_guard lock(mutex_);
  if (first_) return;
  first_ = Error{kind, "own model threw"};  // short enough to need no memory
  try {
    first_->message = fmt::format("own.{} threw{}{}", function, what ? ": " : " ", what ? what : "what is no std::exception");
  } catch (const std::bad_alloc&) {
  }
}

std::optional<Error> OwnWatch::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(first_, std::nullopt);
}

namespace {

/// What `work` returns, or `otherwise` where it throws.
template <class Out, class Work>
Out guarded(OwnWatch& watch, const char* function, Out otherwise, Work&& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc& e) {
    watch.note(Error::Kind::out_of_memory, function, e.what());
  } catch (const std::exception& e) {
    watch.note(Error::Kind::bad_input, function, e.what());
  } catch (...) {
    watch.note(Error::Kind::bad_input, function, nullptr);
  }
  return otherwise;
}

}  // namespace

OwnModel watched(const OwnModel& own, std::shared_ptr<OwnWatch> watch) {
  OwnModel safe = own;
  safe.residual = [watch, call = own.residual](std::span<const double> points, std::span<const double> parameters,
                                               std::span<double> residuals) {
    const bool done = guarded(*watch, "residual", false, [&] {
      call(points, parameters, residuals);
      return true;
    });
    if (!done) std::fill(residuals.begin(), residuals.end(), std::numeric_limits<double>::quiet_NaN());
  };
  safe.solve = [watch, call = own.solve](std::span<const double> points, std::span<double> parameters) {
    return guarded(*watch, "solve", false, [&] { return call(points, parameters); });
  };
  if (own.normalise) {
    safe.normalise = [watch, call = own.normalise](std::span<double> parameters) {
      return guarded(*watch, "normalise", false, [&] { return call(parameters); });
    };
  }
  if (own.refine) {
    safe.refine = [watch, call = own.refine](std::span<const double> points, std::span<const double> weights,
                                             std::span<double> parameters) {
      return guarded(*watch, "refine", false, [&] { return call(points, weights, parameters); });
    };
  }
  if (own.recentre) {
    safe.recentre = [watch, call = own.recentre](std::span<const double> centre, std::span<double> parameters) {
      const bool done = guarded(*watch, "recentre", false, [&] {
        call(centre, parameters);
        return true;
      });
      if (!done) std::fill(parameters.begin(), parameters.end(), std::numeric_limits<double>::quiet_NaN());
    };
  }
  return safe;
}

std::shared_ptr<const kernels::OwnModel> to_kernel(const OwnModel& own) {
  auto kernel = std::make_shared<kernels::OwnModel>();
  kernel->name = own.name;
  kernel->dimension = own.dimension;
  kernel->parameter_count = own.parameter_count;
  kernel->residual = own.residual;
  kernel->recentre = own.recentre;
  kernel->glsl = own.glsl;
  return kernel;
}

}  // namespace models
}  // namespace swarmfit
