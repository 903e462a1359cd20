#include "host/cli/sequence.hpp"

#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <swarmfit/results.hpp>

#include "host/cli/console.hpp"
#include "host/cli/steady_state.hpp"

namespace swarmfit::cli {
namespace {

struct LoadedFrame {
  FrameRef ref;
  Expected<Cloud> cloud;
  double load_ms = 0;
};

std::optional<LoadedFrame> load_next(const FrameSource& next, const std::stop_token& stop) {
  auto ref = next(stop);
  if (!ref) return std::nullopt;
  const Stopwatch loading;
  auto cloud = ref->read();
  return LoadedFrame{std::move(*ref), std::move(cloud), loading.ms()};
}

/// One frame waits here, loaded, while another is worked on. The source is asked for the next once there is room for it: so a slow consumer
/// holds up a source that waits, loses frames of one that does not, and never has more than two in memory.
class Loader {
 public:
  explicit Loader(const FrameSource& next) : next_(next), thread_([this](const std::stop_token& stop) { run(stop); }) {}

  /// Nothing at the end, or once `stop` is asked for.
  std::optional<LoadedFrame> take(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [this] { return frame_ || ended_; });
    if (stop.stop_requested()) return std::nullopt;
    auto taken = std::exchange(frame_, std::nullopt);
    changed_.notify_all();
    return taken;
  }

 private:
  void run(const std::stop_token& stop) {
    for (;;) {
      {
        std::unique_lock lock(mutex_);
        if (!changed_.wait(lock, stop, [this] { return !frame_; })) return;
      }
      auto loaded = load_next(next_, stop);
      const std::scoped_lock lock(mutex_);
      ended_ = !loaded;
      frame_ = std::move(loaded);
      changed_.notify_all();
      if (ended_) return;
    }
  }

  const FrameSource& next_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<LoadedFrame> frame_;
  bool ended_ = false;
  std::jthread thread_;  // last: it works on the rest
};

/// Lines to a file or to stdout, each out before the next is begun.
class Lines {
 public:
  static Expected<Lines> open(const std::string& file) {
    Lines lines;
    if (file.empty()) return lines;
    lines.name_ = file;
    lines.file_.reset(std::fopen(file.c_str(), "wb"));
    if (!lines.file_) return fail(Error::Kind::cannot_write, file + ": cannot be written: " + std::generic_category().message(errno));
    return lines;
  }
  Expected<> write(const std::string& line) {
    std::FILE* to = file_ ? file_.get() : stdout;
    if (std::fwrite(line.data(), 1, line.size(), to) == line.size() && std::fflush(to) == 0) return {};
    return fail(Error::Kind::cannot_write, (file_ ? name_ : "stdout") + ": cannot be written: " + std::generic_category().message(errno));
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::string name_;
  std::unique_ptr<std::FILE, Close> file_;
};

/// One frame's fault, or all work's?
bool of_one_frame(const Error& error) { return error.kind == Error::Kind::bad_input || error.kind == Error::Kind::out_of_memory; }

Error in_frame(const FrameRef& ref, Error error) {
  if (error.message.find(ref.input) == std::string::npos) error.message = ref.input + ": " + error.message;
  return error;
}

class Sequence {
 public:
  Sequence(const SequenceJob& job, Perceiver& perceiver, Lines& lines) : job_(job), perceiver_(perceiver), lines_(lines) {}

  int run() {
    const Interrupt interrupt;
    const Stopwatch whole;
    {
      Progress progress(job_.output.quiet);
      std::optional<Loader> loader;
      if (job_.ahead) loader.emplace(job_.next);
      const auto stop = interrupt.token();
      while (auto frame = loader ? loader->take(stop) : load_next(job_.next, stop)) {
        progress.say(fmt::format("frame {}, {}", frame->ref.index, frame->ref.name));
        auto done = work_on(*frame, stop);
        if (!done && of_one_frame(done.error())) {
          code_ = complain(in_frame(frame->ref, done.error()));
          times_.skip();
        } else if (!done) {
          return complain(done.error());
        }
        if (stop.stop_requested()) break;
      }
    }
    if (!job_.output.quiet) {
      tell(times_.report(whole.ms() / 1000));
      if (job_.more) tell(job_.more());
    }
    return code_;
  }

 private:
  Expected<> work_on(LoadedFrame& frame, const std::stop_token& stop) {
    times_.drop(frame.ref.index - std::exchange(expected_, frame.ref.index + 1));
    if (!frame.cloud) return tl::unexpected(frame.cloud.error());
    auto result = perceiver_.perceive(*frame.cloud, {}, stop);
    if (!result) return tl::unexpected(result.error());
    if (stop.stop_requested()) return {};  // half a frame is none
    result->timing_ms.load = frame.load_ms;
    times_.add(result->timing_ms.total, frame.load_ms);
    if (auto ok = lines_.write(to_json_line(*result, *frame.cloud, frame.ref.index, frame.ref.name)); !ok) return ok;
    if (!job_.output.out.empty()) {
      const auto folder = std::filesystem::path(job_.output.out) / frame.ref.name;
      if (auto ok = write_perception(folder, *result, *frame.cloud); !ok) return ok;
    }
    if (job_.watch) job_.watch(frame.ref, *result, *frame.cloud);
    return {};
  }

  const SequenceJob& job_;
  Perceiver& perceiver_;
  Lines& lines_;
  SteadyState times_;
  std::size_t expected_ = 0;
  int code_ = kDone;
};

}  // namespace

int run_sequence(const SequenceJob& job) {
  if (auto ok = job.output.check(); !ok) return complain(ok.error());
  PerceiveOptions options = job.options;
  options.track = true;
  auto perceiver = Perceiver::create(options);
  if (!perceiver) return complain(perceiver.error());
  auto lines = Lines::open(job.output.json);
  if (!lines) return complain(lines.error());
  return Sequence(job, *perceiver, *lines).run();
}

}  // namespace swarmfit::cli
