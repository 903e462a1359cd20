#include "host/cli/frames.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string_view>
#include <thread>

#include <sys/poll.h>
#include <unistd.h>

#include <fmt/format.h>

namespace swarmfit::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kLongestName = 65536;  // bytes of a line on stdin; what is longer is no file's name

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// frame2 before frame10.
bool before(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    std::size_t first = a.find_first_not_of('0', i), second = b.find_first_not_of('0', j);
    i = first = std::min(first, a.size());
    j = second = std::min(second, b.size());
    while (i < a.size() && is_digit(a[i])) ++i;
    while (j < b.size() && is_digit(b[j])) ++j;
    if (i - first != j - second) return i - first < j - second;
    if (const int order = a.compare(first, i - first, b, second, j - second); order != 0) return order < 0;
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

bool is_cloud(const fs::path& file) {
  const std::string extension = ending_of(file);
  return extension == ".pcd" || extension == ".ply" || extension == ".xyz";
}

constexpr std::string_view kDepthEnding = "depth.png";

bool is_depth(const fs::path& file) { return lower(file.filename().string()).ends_with(kDepthEnding); }

/// The colour image beside 7.depth.png: 7.color.png, 7.colour.png, 7.rgb.png; empty: there is none.
fs::path colour_of(const fs::path& depth) {
  const std::string name = depth.filename().string(), stem = name.substr(0, name.size() - kDepthEnding.size());
  for (const char* ending : {"color.png", "colour.png", "rgb.png"}) {
    std::error_code error;
    if (fs::exists(depth.parent_path() / (stem + ending), error)) return depth.parent_path() / (stem + ending);
  }
  return {};
}

std::string name_of(const fs::path& file) {
  std::string name = file.filename().string();
  if (is_depth(file)) {
    name.resize(name.size() - kDepthEnding.size());
    while (!name.empty() && (name.back() == '.' || name.back() == '_' || name.back() == '-')) name.pop_back();
  } else {
    name = file.stem().string();
  }
  return name.empty() || name == ".." ? "frame" : name;
}

Expected<FrameRef> frame_of(const fs::path& file, const std::optional<DepthCamera>& camera) {
  FrameRef frame{0, name_of(file), file.string(), {}};
  if (!is_depth(file)) {
    frame.read = [file] { return read_cloud(file); };
    return frame;
  }
  if (!camera) return fail(Error::Kind::invalid_option, file.string() + ": --intrinsics FX,FY,CX,CY is needed with a depth image");
  frame.read = [file, camera = *camera] {
    const fs::path colour = colour_of(file);
    return colour.empty() ? read_depth(file, camera.intrinsics, camera.scale) : read_rgbd(colour, file, camera.intrinsics, camera.scale);
  };
  return frame;
}

/// The clouds a folder holds, or else its depth images.
Expected<std::vector<fs::path>> look_into(const fs::path& folder) {
  std::vector<fs::path> clouds, depths;
  std::error_code error;
  fs::directory_iterator it(folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const fs::path& file = it->path();
    if (file.filename().string().starts_with('.')) continue;
    if (is_cloud(file)) clouds.push_back(file);
    if (is_depth(file)) depths.push_back(file);
  }
  if (error) return fail(Error::Kind::bad_input, folder.string() + ": cannot be read as a folder: " + error.message());
  auto& found = clouds.empty() ? depths : clouds;
  if (found.empty())
    return fail(Error::Kind::bad_input, folder.string() + ": a folder that holds no frame: no .pcd, .ply, .xyz, no *depth.png");
  std::sort(found.begin(), found.end(),
            [](const fs::path& a, const fs::path& b) { return before(a.filename().string(), b.filename().string()); });
  return found;
}

/// Lines of stdin as they come, never waiting longer than it is asked to.
class Lines {
 public:
  /// The next line; nothing where stdin ended or a stop was asked for. Without `wait`, nothing where none is there yet, too.
  std::optional<std::string> next(const std::stop_token& stop, bool wait) {
    for (;;) {
      if (const auto end = text_.find('\n'); end != std::string::npos) {
        std::string line = text_.substr(0, end);
        text_.erase(0, end + 1);
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (line.empty()) continue;
        return line;
      }
      if (ended_ && !text_.empty()) return std::exchange(text_, {});
      if (ended_ || stop.stop_requested() || !fill(wait)) return std::nullopt;
    }
  }

 private:
  /// False where nothing has come and none is waited for.
  bool fill(bool wait) {
    pollfd in{STDIN_FILENO, POLLIN, 0};
    if (::poll(&in, 1, wait ? 100 : 0) <= 0) return wait;
    char bytes[4096];
    const ssize_t n = ::read(STDIN_FILENO, bytes, sizeof bytes);
    if (n < 0 && errno == EINTR) return true;
    if (n <= 0) ended_ = true;
    if (n > 0 && text_.size() < kLongestName) text_.append(bytes, static_cast<std::size_t>(n));
    return true;
  }

  std::string text_;
  bool ended_ = false;
};

/// Names are folders: where two frames have one, each is told by its place.
void make_unique(std::vector<FrameRef>& frames) {
  std::map<std::string, std::size_t> count;
  for (const FrameRef& frame : frames) ++count[frame.name];
  const std::size_t digits = fmt::format("{}", frames.empty() ? 0 : frames.size() - 1).size();
  const bool unique = count.size() == frames.size();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].index = i;
    if (!unique) frames[i].name = fmt::format("{:0{}}-{}", i, digits, frames[i].name);
  }
}

}  // namespace

std::string ending_of(const fs::path& file) { return lower(file.extension().string()); }

bool is_sequence(const std::vector<std::string>& inputs) {
  std::error_code error;
  return inputs.size() > 1 || (inputs.size() == 1 && (inputs[0] == "-" || fs::is_directory(inputs[0], error)));
}

Expected<std::vector<FrameRef>> list_frames(const std::vector<std::string>& inputs, const std::optional<DepthCamera>& camera) {
  std::vector<FrameRef> frames;
  for (const std::string& input : inputs) {
    std::error_code error;
    std::vector<fs::path> files = {input};
    if (fs::is_directory(input, error)) {
      auto found = look_into(input);
      if (!found) return tl::unexpected(found.error());
      files = std::move(*found);
    }
    for (const fs::path& file : files) {
      auto frame = frame_of(file, camera);
      if (!frame) return tl::unexpected(frame.error());
      frames.push_back(std::move(*frame));
    }
  }
  make_unique(frames);
  return frames;
}

FrameSource play(std::vector<FrameRef> frames) {
  return [frames = std::move(frames), next = std::size_t{0}](const std::stop_token& stop) mutable -> std::optional<FrameRef> {
    if (next >= frames.size() || stop.stop_requested()) return std::nullopt;
    return frames[next++];
  };
}

FrameSource play_at(std::vector<FrameRef> frames, double fps, bool drop) {
  std::optional<Clock::time_point> start;
  return [=, frames = std::move(frames), next = std::size_t{0}](const std::stop_token& stop) mutable -> std::optional<FrameRef> {
    if (!start) start = Clock::now();
    const auto due = [&](std::size_t k) {
      return *start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(static_cast<double>(k) / fps));
    };
    while (drop && next + 1 < frames.size() && due(next + 1) <= Clock::now()) ++next;
    if (next >= frames.size()) return std::nullopt;
    while (!stop.stop_requested() && Clock::now() < due(next))
      std::this_thread::sleep_until(std::min(due(next), Clock::now() + std::chrono::milliseconds(100)));
    if (stop.stop_requested()) return std::nullopt;
    return frames[next++];
  };
}

FrameSource read_names(std::optional<DepthCamera> camera, bool drop) {
  auto lines = std::make_shared<Lines>();
  return [=, next = std::size_t{0}](const std::stop_token& stop) mutable -> std::optional<FrameRef> {
    auto line = lines->next(stop, true);
    if (!line) return std::nullopt;
    while (drop) {
      auto later = lines->next(stop, false);
      if (!later) break;
      line = std::move(later);
      ++next;
    }
    const std::string file = *line;
    auto frame = frame_of(file, camera);
    FrameRef ref{0, name_of(file), file, {}};
    if (frame) {
      ref = std::move(*frame);
    } else {
      ref.read = [error = frame.error()]() -> Expected<Cloud> { return tl::unexpected(error); };
    }
    ref.index = next++;
    return ref;
  };
}

}  // namespace swarmfit::cli
