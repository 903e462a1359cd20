// Work on a thread of its own, without Python's lock, while the caller's thread waits and looks out for Ctrl-C.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>

#include <nanobind/nanobind.h>

#include <swarmfit/error.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/report.hpp>

namespace swarmfit::python {

/// To be made, asked and dropped with Python's lock held; the work never needs it. Dropped before its end, it is stopped and waited for.
template <class Result>
class Job {
 public:
  using Work = std::function<Expected<Result>(const ModelCallback&, std::stop_token)>;
  /// lockstep: the work waits for an answer to each model; runs_ahead: it goes on while the model is looked at.
  enum class Pace { lockstep, runs_ahead };

  Job(Work work, Pace pace) : pace_(pace), thread_([this, work = std::move(work)](const std::stop_token& stop) { run(work, stop); }) {}
  ~Job() {
    const nanobind::gil_scoped_release unlocked;
    stop();
    thread_ = {};
  }

  /// The next model as it is found, none when the work has ended. Raises KeyboardInterrupt, and the work is stopped.
  std::optional<Model> next() {
    wait([this] { return !models_.empty() || result_; });
    const std::scoped_lock lock(mutex_);
    if (models_.empty()) return std::nullopt;
    Model model = std::move(models_.front());
    models_.pop_front();
    return model;
  }
  /// In lockstep, after each model.
  void answer(Verdict verdict) {
    {
      const std::scoped_lock lock(mutex_);
      answer_ = verdict;
    }
    changed_.notify_all();
  }
  /// Waits for the end. Raises KeyboardInterrupt, and the work is stopped. To be asked once.
  Expected<Result> result() {
    wait([this] { return result_.has_value(); });
    return std::move(*result_);
  }
  /// The work ends soon, with what there is.
  void stop() {
    {
      const std::scoped_lock lock(mutex_);
      stopped_ = true;
    }
    thread_.request_stop();
    changed_.notify_all();
  }

 private:
  template <class Ready>
  void wait(const Ready& ready) {
    using namespace std::chrono_literals;
    for (;;) {
      {
        const nanobind::gil_scoped_release unlocked;
        std::unique_lock lock(mutex_);
        if (changed_.wait_for(lock, 50ms, ready)) return;
      }
      if (PyErr_CheckSignals() != 0) {
        stop();
        throw nanobind::python_error();
      }
    }
  }

  Verdict found(const Model& model) {
    std::unique_lock lock(mutex_);
    models_.push_back(model);
    answer_.reset();
    changed_.notify_all();
    if (pace_ == Pace::lockstep) changed_.wait(lock, [this] { return answer_ || stopped_; });
    return stopped_ ? Verdict::stop : answer_.value_or(Verdict::go_on);
  }

  void run(const Work& work, const std::stop_token& stop) {
    std::optional<Expected<Result>> result;
    try {
      result.emplace(work([this](const Model& model) { return found(model); }, stop));
    } catch (const std::exception& e) {
      result.emplace(fail(Error::Kind::bad_input, e.what()));
    }
    const std::scoped_lock lock(mutex_);
    result_ = std::move(result);
    changed_.notify_all();
  }

  const Pace pace_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Model> models_;
  std::optional<Verdict> answer_;
  bool stopped_ = false;
  std::optional<Expected<Result>> result_;
  std::jthread thread_;  // last: it uses all of the above
};

/// The same work, its swarms' steps and the models as they are found put down in `record`; null: the work as it is.
template <class Result, class ToolType>
typename Job<Result>::Work recorded(ToolType& tool, SearchRecord* record, typename Job<Result>::Work work) {
  if (record == nullptr) return work;
  return [&tool, record, work = std::move(work)](const ModelCallback& on_model, std::stop_token stop) {
    tool.observe([record](const SwarmStep& step) { record->add(step); });
    auto result = work(
        [record, &on_model](const Model& model) {
          record->add(model);
          return on_model ? on_model(model) : Verdict::go_on;
        },
        std::move(stop));
    tool.observe({});
    return result;
  };
}

/// Waits for the end of the work; `on_model`, where there is one, is told of each model and returns False to stop.
template <class Result>
Expected<Result> run_to_end(typename Job<Result>::Work work, nanobind::handle on_model) {
  using JobType = Job<Result>;
  if (on_model.is_none()) {
    JobType job([&work](const ModelCallback&, std::stop_token stop) { return work({}, std::move(stop)); }, JobType::Pace::runs_ahead);
    return job.result();
  }
  JobType job(std::move(work), JobType::Pace::lockstep);
  while (auto model = job.next()) {
    const nanobind::object answer = on_model(nanobind::cast(std::move(*model)));
    job.answer(answer.is(nanobind::handle(Py_False)) ? Verdict::stop : Verdict::go_on);
  }
  return job.result();
}

}  // namespace swarmfit::python
