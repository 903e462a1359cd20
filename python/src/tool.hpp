// A Fitter or a Perceiver in Python's hands: made without Python's lock, used by one thread at a time.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <nanobind/nanobind.h>

#include "python/src/errors.hpp"

namespace swarmfit::python {

template <class T>
struct Tool {
  explicit Tool(T made) : tool(std::move(made)) {}
  T tool;
  std::atomic<bool> busy = false;
};

template <class T, class Options>
std::shared_ptr<Tool<T>> make_tool(const Options& options) {
  std::optional<Expected<T>> made;
  {
    const nanobind::gil_scoped_release unlocked;  // a device or a gallery may take its time
    made.emplace(T::create(options));
  }
  return std::make_shared<Tool<T>>(value_of(std::move(*made)));
}

/// Takes the tool while it lives; throws where it is taken. `name`: what Python calls it.
template <class T>
class Shift {
 public:
  Shift(std::shared_ptr<Tool<T>> tool, const char* name) : tool_(std::move(tool)) {
    if (tool_->busy.exchange(true)) throw std::runtime_error(std::string("this ") + name + " is at work; make one a thread");
  }
  ~Shift() { tool_->busy = false; }
  Shift(const Shift&) = delete;
  Shift& operator=(const Shift&) = delete;
  T& tool() const { return tool_->tool; }

 private:
  std::shared_ptr<Tool<T>> tool_;
};

}  // namespace swarmfit::python
