// All contenders on the same clouds in the same run, one after another, run by run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <swarmfit/cloud.hpp>
#include <swarmfit/results.hpp>

#include "bench/report.hpp"

namespace swarmfit::peers {

// The contenders of this build, and why others are not in it: AVAILABLE(factory), MISSING(name, reason).
#define AVAILABLE(factory) SWARMFIT_CONTENDER(factory);
#define MISSING(name, reason)
#include "contenders.inc"
#undef AVAILABLE
#undef MISSING

namespace {

using Clock = std::chrono::steady_clock;

struct Arguments {
  std::vector<std::string> clouds;
  std::string depth, intrinsics, json, only;
  double depth_scale = 0.001, threshold = 0.01, min_share = 0.01, budget = 60, pause = 0.03;
  int runs = 20, threads = 0;
};

std::vector<std::unique_ptr<Contender>> contenders() {
  std::vector<std::unique_ptr<Contender>> all;
#define AVAILABLE(factory) all.push_back(factory());
#define MISSING(name, reason)
#include "contenders.inc"
#undef AVAILABLE
#undef MISSING
  return all;
}

std::vector<Missing> missing() {
  std::vector<Missing> all;
#define AVAILABLE(factory)
#define MISSING(name, reason) all.push_back({name, reason});
#include "contenders.inc"
#undef AVAILABLE
#undef MISSING
  return all;
}

/// Processor time that this process has used, all threads together [ms].
double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double load_average() {
  double load = 0;
  return getloadavg(&load, 1) == 1 ? load : std::numeric_limits<double>::quiet_NaN();
}

Scene to_scene(std::string name, const Cloud& cloud) {
  if (cloud.dimension != 3) throw std::runtime_error(fmt::format("{}: points have {} columns, must have 3", name, cloud.dimension));
  Scene scene;
  scene.name = std::move(name);
  scene.width = cloud.organised() ? cloud.width : static_cast<int>(cloud.size());
  scene.height = cloud.organised() ? cloud.height : 1;
  scene.grid = cloud.values32;
  for (const double v : cloud.values64) scene.grid.push_back(static_cast<float>(v));
  for (std::size_t i = 0; i < scene.grid.size() / 3; ++i) {
    const float* x = scene.grid.data() + 3 * i;
    if (!std::isfinite(x[0]) || !std::isfinite(x[1]) || !std::isfinite(x[2])) {
      std::fill_n(scene.grid.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, std::numeric_limits<float>::quiet_NaN());
      continue;
    }
    scene.points.insert(scene.points.end(), x, x + 3);
    scene.source.push_back(static_cast<std::uint32_t>(i));
  }
  return scene;
}

Scene must(std::string name, const Expected<Cloud>& cloud) {
  if (!cloud) throw std::runtime_error(cloud.error().message);
  return to_scene(std::move(name), *cloud);
}

std::vector<Scene> read_scenes(const Arguments& arguments) {
  std::vector<Scene> scenes;
  for (const std::string& file : arguments.clouds) scenes.push_back(must(std::filesystem::path(file).stem().string(), read_cloud(file)));
  if (!arguments.depth.empty()) {
    Intrinsics camera;
    if (std::sscanf(arguments.intrinsics.c_str(), "%lf,%lf,%lf,%lf", &camera.fx, &camera.fy, &camera.cx, &camera.cy) != 4) {
      throw std::runtime_error("--intrinsics: must be FX,FY,CX,CY");
    }
    scenes.push_back(
        must(std::filesystem::path(arguments.depth).filename().string(), read_depth(arguments.depth, camera, arguments.depth_scale)));
  }
  if (scenes.empty()) throw std::runtime_error("no cloud given, see --help");
  return scenes;
}

/// A contender on a scene, run after run.
class Lane {
 public:
  Lane(Contender& contender, const Scene& scene, const Task& task) : contender_(contender) {
    entry_.name = contender.name();
    entry_.how = contender.how();
    entry_.organised = contender.organised();
    attempt([&] {
      contender_.take(scene, task);
      contender_.run(0);  // memory, caches, threads: not timed
    });
  }

  bool willing(double budget) const { return entry_.failure.empty() && (entry_.ms.size() < 3 || spent_ < budget); }

  void run(std::uint64_t seed) {
    attempt([&] {
      const double cpu = cpu_ms();
      const auto start = Clock::now();
      Found found = contender_.run(seed);
      const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
      spent_ += ms / 1000;
      entry_.ms.push_back(ms);
      entry_.cpu_ms.push_back(cpu_ms() - cpu);
      entry_.normals_ms.push_back(found.normals_ms);
      entry_.planes.push_back(static_cast<double>(found.planes.size()));
      entry_.evaluations.push_back(static_cast<double>(found.evaluations));
      founds_.push_back(std::move(found));
    });
  }

  void judge(const Judge& judge) {
    for (const Found& found : founds_) {
      verdicts_.push_back(judge.judge(found, entry_.organised));
      entry_.counted.push_back(static_cast<double>(verdicts_.back().counted));
      entry_.inliers.push_back(static_cast<double>(verdicts_.back().inliers));
    }
    founds_.clear();
    if (!verdicts_.empty()) entry_.first = verdicts_.front().planes;
  }

  void compare(const Judge& judge, const Lane& ours) {
    const auto not_had = [&](const Verdict& mine, const Verdict& others) {
      return static_cast<double>(std::count_if(mine.planes.begin(), mine.planes.end(),
                                               [&](const Judged& plane) { return plane.counts && !judge.has(others, plane); }));
    };
    for (std::size_t r = 0; r < std::min(verdicts_.size(), ours.verdicts_.size()); ++r) {
      entry_.beyond.push_back(not_had(verdicts_[r], ours.verdicts_[r]));
      entry_.lacked.push_back(not_had(ours.verdicts_[r], verdicts_[r]));
    }
  }

  void collect(const Judge& judge, std::vector<Surface>& surfaces) const {
    for (const Verdict& verdict : verdicts_) judge.collect(verdict, entry_.name, surfaces);
  }

  void count(const Judge& judge, Surface& surface) const {
    if (verdicts_.empty()) return;
    surface.runs[entry_.name] = static_cast<int>(
        std::count_if(verdicts_.begin(), verdicts_.end(), [&](const Verdict& verdict) { return judge.has(verdict, surface.seen); }));
  }

  const Entry& entry() const noexcept { return entry_; }

 private:
  void attempt(const std::function<void()>& work) {
    try {
      work();
    } catch (const std::exception& failure) {
      entry_.failure = failure.what();
    }
  }

  Contender& contender_;
  Entry entry_;
  double spent_ = 0;
  std::vector<Found> founds_;
  std::vector<Verdict> verdicts_;
};

SceneReport run_scene(const Scene& scene, const Arguments& arguments, const std::vector<std::unique_ptr<Contender>>& all) {
  SceneReport report;
  report.name = scene.name;
  report.points = scene.grid.size() / 3;
  report.finite = scene.size();
  report.task.threshold = arguments.threshold;
  report.task.threads = arguments.threads;
  report.task.min_inliers =
      std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(arguments.min_share * static_cast<double>(scene.size()))));
  std::vector<Lane> lanes;
  lanes.reserve(all.size());
  for (const auto& contender : all) {
    fmt::print(stderr, "\r\033[K{}: {}, first run", scene.name, contender->name());
    lanes.emplace_back(*contender, scene, report.task);
  }
  for (int run = 1; run <= arguments.runs; ++run) {
    fmt::print(stderr, "\r\033[K{}: run {} of {}", scene.name, run, arguments.runs);
    for (std::size_t k = 0; k < lanes.size(); ++k) {
      Lane& lane = lanes[(k + static_cast<std::size_t>(run)) % lanes.size()];  // nobody always follows the same one
      if (!lane.willing(arguments.budget)) continue;
      std::this_thread::sleep_for(std::chrono::duration<double>(arguments.pause));  // threads that still spin go to sleep
      lane.run(static_cast<std::uint64_t>(run));
    }
  }
  fmt::print(stderr, "\r\033[K{}: judging\r\033[K", scene.name);
  const Judge judge(scene, report.task);
  for (Lane& lane : lanes) lane.judge(judge);
  for (Lane& lane : lanes) {
    if (&lane != &lanes.front()) lane.compare(judge, lanes.front());
  }
  for (const Lane& lane : lanes) lane.collect(judge, report.surfaces);
  for (Surface& surface : report.surfaces) {
    for (const Lane& lane : lanes) lane.count(judge, surface);
  }
  for (const Lane& lane : lanes) report.entries.push_back(lane.entry());
  return report;
}

int run(Arguments arguments) {
  if (arguments.threads == 0) arguments.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::vector<std::unique_ptr<Contender>> all = contenders();
  if (!arguments.only.empty()) {
    std::erase_if(all, [&](const auto& contender) {
      return contender != all.front() && contender->name().find(arguments.only) == std::string::npos;
    });
  }
  Report report;
  report.threads = arguments.threads;
  report.runs = arguments.runs;
  report.missing = missing();
  report.load_before = load_average();
  for (const Scene& scene : read_scenes(arguments)) {
    report.scenes.push_back(run_scene(scene, arguments, all));
    fmt::print("{}\n", table(report.scenes.back()));
    std::fflush(stdout);
  }
  report.load_after = load_average();
  fmt::print("{}load average {:.1f} before, {:.1f} after\n", table(report.missing), report.load_before, report.load_after);
  if (!arguments.json.empty()) {
    if (auto done = write_text(arguments.json, to_json(report)); !done) throw std::runtime_error(done.error().message);
  }
  return 0;
}

}  // namespace
}  // namespace swarmfit::peers

int main(int count, char** values) {
  swarmfit::peers::Arguments a;
  CLI::App app("All planes with a label a point: Swarmfit and its peers on the same clouds, in turns", "swarmfit_peers");
  app.add_option("clouds", a.clouds, "Clouds: .pcd, .ply, .xyz, .csv")->type_name("FILE...");
  app.add_option("--depth", a.depth, "A 16-bit depth PNG as one more cloud")->type_name("PNG");
  app.add_option("--intrinsics", a.intrinsics, "Of the depth image")->type_name("FX,FY,CX,CY");
  app.add_option("--depth-scale", a.depth_scale, "Metres a unit of depth")->capture_default_str();
  app.add_option("--threshold", a.threshold, "Of a plane's inliers, in the data's unit")->capture_default_str();
  app.add_option("--min-share", a.min_share, "Of the finite points a plane must hold")->capture_default_str();
  app.add_option("--runs", a.runs, "Runs of each contender on each cloud")->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--budget", a.budget, "Seconds after which a contender gets no further run on a cloud, once it has had three")
      ->capture_default_str();
  app.add_option("--threads", a.threads, "Of contenders that can be told; 0: all")->check(CLI::Range(0, 4096))->capture_default_str();
  app.add_option("--only", a.only, "Ours, and contenders whose name holds this")->type_name("TEXT");
  app.add_option("--json", a.json, "Everything as JSON")->type_name("FILE");
  app.footer(
      "found: planes reported. count: those that hold their points and are surfaces. inliers: held by these, of the finite points.\n"
      "beyond: planes that count and that Swarmfit, in the same run, has not. lacking: Swarmfit's that the contender has not.");
  CLI11_PARSE(app, count, values);
  try {
    return swarmfit::peers::run(std::move(a));
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "swarmfit_peers: %s\n", failure.what());
    return 3;
  }
}
