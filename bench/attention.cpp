// What attention saves in recognition: the same gallery looked for in the whole image, and inside proto-objects alone. On the built-in
// scene, whose truth says which matches and which names are right.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgproc.hpp>

#include <swarmfit/perception.hpp>
#include <swarmfit/results.hpp>
#include <swarmfit/scene.hpp>

#include "host/io/png.hpp"
#include "host/perception/gallery_pictures.hpp"
#include "host/perception/recognition.hpp"

namespace swarmfit::attention {
namespace {

namespace fs = std::filesystem;
using perception::Features;

struct Arguments {
  int scenes = 10, strangers = 20, runs = 5;
};

/// A folder of its own, gone with it.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(fs::temp_directory_path() / fmt::format("swarmfit-attention-{}", ::getpid())) { fs::create_directories(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// One entry of the gallery: its features, and the truth's label of the thing that carries it, 0 for one that is not to be seen.
struct Entry {
  std::string name;
  std::uint16_t object = 0;
  Features features;
};

std::vector<Entry> fill_gallery(const fs::path& folder, const Scene& scene, std::uint64_t seed, int strangers) {
  std::vector<Entry> entries;
  const auto add = [&](const ScenePicture& picture, const std::string& name, std::uint16_t object) {
    const cv::Mat rgb(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.rgb.data()));  // only read
    const fs::path file = folder / (name + ".png");
    const std::string bytes = io::encode_png(rgb);
    if (!write_text(file, bytes)) return;
    if (auto features = perception::picture_features(file, bytes)) entries.push_back({name, object, std::move(*features)});
  };
  for (const ScenePicture& picture : scene.pictures) add(picture, picture.name, picture.object);
  int left = strangers;
  for (std::uint64_t other = 1000 * seed; left > 0; ++other)
    for (const ScenePicture& picture : make_room_scene(other, 64, 48).pictures)
      if (left-- > 0) add(picture, fmt::format("stranger{}", left), 0);
  return entries;
}

/// What the matcher is given to do, and how much of it is in vain.
struct Work {
  std::size_t features = 0, matches = 0, wrong = 0;  ///< wrong: not on the thing whose picture was matched
};

Work match_all(const Scene& scene, const std::vector<std::uint16_t>& regions, std::size_t count, const std::vector<Entry>& gallery) {
  const cv::Size size(scene.cloud.width, scene.cloud.height);
  cv::Mat1b grey;
  cv::cvtColor(cv::Mat(size, CV_8UC3, const_cast<std::uint8_t*>(scene.cloud.rgb.data())), grey, cv::COLOR_RGB2GRAY);
  const cv::Mat1w labels(size.height, size.width, const_cast<std::uint16_t*>(regions.data()));
  Work work;
  for (std::size_t k = 1; k <= count; ++k) {
    const cv::Mat1b mask = labels == static_cast<double>(k);
    cv::Rect box = cv::boundingRect(mask);
    if (box.empty()) continue;
    const int border = perception::kBorder;
    box = (box - cv::Point(border, border) + cv::Size(2 * border, 2 * border)) & cv::Rect({}, size);
    cv::Mat1b patch = grey(box), inside = mask(box);
    perception::look_closer(patch, inside);
    const double zoom = static_cast<double>(patch.cols) / box.width;
    const Features seen = perception::find_features(patch, inside);
    work.features += seen.points.size();
    for (const Entry& entry : gallery)
      for (const auto& match : perception::match_features(entry.features, seen)) {
        const cv::Point2d at = cv::Point2d(seen.points[static_cast<std::size_t>(match.seen)].pt) / zoom;
        const auto u = static_cast<std::size_t>(box.x + at.x), v = static_cast<std::size_t>(box.y + at.y);
        const auto truth = scene.truth.object_labels[v * static_cast<std::size_t>(size.width) + u];
        ++work.matches;
        work.wrong += entry.object == 0 || truth != entry.object;
      }
  }
  return work;
}

/// Of all threads together: what else runs on the machine does not count.
double median_cpu_ms(int runs, const std::function<void()>& body) {
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    const std::clock_t start = std::clock();
    body();
    times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

struct Row {
  double ms = 0;
  Work work;
  std::size_t right = 0, wrong = 0;  ///< names
};

Row look(const Scene& scene, const std::vector<std::uint16_t>& regions, std::size_t count, const std::vector<Entry>& entries,
         const perception::Gallery& gallery, int runs) {
  Row row;
  row.work = match_all(scene, regions, count, entries);
  std::vector<std::vector<Recognition>> names;
  row.ms = median_cpu_ms(runs, [&] { names = gallery.recognise(scene.cloud, regions, count); });
  std::set<std::string> given;
  for (std::size_t k = 0; k < names.size(); ++k)
    for (const Recognition& name : names[k]) {
      const auto entry = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == name.name; });
      // A name is right where its thing is, once.
      bool there = false;
      for (std::size_t i = 0; i < regions.size() && !there; ++i)
        there = entry->object != 0 && regions[i] == k + 1 && scene.truth.object_labels[i] == entry->object;
      const bool right = there && given.insert(name.name).second;
      ++(right ? row.right : row.wrong);
    }
  return row;
}

void add(const Row& row, Row& sum) {
  sum.ms += row.ms;
  sum.work.features += row.work.features;
  sum.work.matches += row.work.matches;
  sum.work.wrong += row.work.wrong;
  sum.right += row.right;
  sum.wrong += row.wrong;
}

void print(const char* where, const Row& sum, int scenes) {
  const double n = scenes;
  fmt::print("| {} | {:.1f} | {:.0f} | {:.1f} | {:.1f} | {} | {} |\n", where, sum.ms / n, static_cast<double>(sum.work.features) / n,
             static_cast<double>(sum.work.matches) / n, static_cast<double>(sum.work.wrong) / n, sum.right, sum.wrong);
}

int run(const Arguments& arguments) {
  Row whole, attended;
  std::size_t carried = 0;
  double before = 0;
  PerceiveOptions options;
  options.camera_tilt = 0.5236;  // the scene's camera looks down by 30 degrees
  auto perceiver = Perceiver::create(options);
  if (!perceiver) {
    fmt::print(stderr, "{}\n", perceiver.error().message);
    return 1;
  }
  for (int k = 1; k <= arguments.scenes; ++k) {
    const auto seed = static_cast<std::uint64_t>(k);
    const Scene scene = make_room_scene(seed);
    const TemporaryFolder folder;
    const auto entries = fill_gallery(folder.path(), scene, seed, arguments.strangers);
    const auto gallery = perception::Gallery::load(folder.path());
    const auto result = perceiver->perceive(scene.cloud);
    if (!gallery || !result) {
      fmt::print(stderr, "{}\n", gallery ? result.error().message : gallery.error().message);
      return 1;
    }
    before += median_cpu_ms(arguments.runs, [&] { (void)perceiver->perceive(scene.cloud); });
    carried += static_cast<std::size_t>(std::count_if(entries.begin(), entries.end(), [](const Entry& e) { return e.object != 0; }));
    add(look(scene, std::vector<std::uint16_t>(scene.cloud.size(), 1), 1, entries, *gallery, arguments.runs), whole);
    add(look(scene, result->objects, result->sois.size(), entries, *gallery, arguments.runs), attended);
  }
  fmt::print("{} scenes, {} known things to be seen, {} strangers in each gallery; planes to outlines take {:.1f} CPU ms a frame\n\n",
             arguments.scenes, carried, arguments.strangers, before / arguments.scenes);
  fmt::print(
      "| looked at | CPU ms a frame | features | matches | of them false | right names | false names |\n|---|---|---|---|---|---|---|\n");
  print("whole image", whole, arguments.scenes);
  print("proto-objects", attended, arguments.scenes);
  return 0;
}

}  // namespace
}  // namespace swarmfit::attention

int main(int argc, char** argv) {
  swarmfit::attention::Arguments arguments;
  CLI::App app("What attention saves in recognition, on the built-in scene");
  app.add_option("--scenes", arguments.scenes, "Seeds 1 to N")->capture_default_str()->check(CLI::Range(1, 1000));
  app.add_option("--strangers", arguments.strangers, "Pictures in the gallery of things that are not there")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_option("--runs", arguments.runs, "Times are medians over so many")->capture_default_str()->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  return swarmfit::attention::run(arguments);
}
