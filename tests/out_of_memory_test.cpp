// Memory runs out anywhere in a call: the answer is an error or, where the call can do without, the same as ever; nothing is lost, and what
// was called can be called again.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <swarmfit/swarmfit.hpp>

#include "host/models/synthetic.hpp"
#include "host/swarm/lock_step.hpp"
#include "tests/failing_memory.hpp"
#include "tests/io_files.hpp"
#include "tests/perception_fixture.hpp"

/// For LeakSanitizer, where there is one: OpenCV takes an image's pixels first and then what holds them, and where that fails they are
/// lost.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:cv::Mat::create\nleak:cv::_OutputArray::create\n"; }

namespace swarmfit {
namespace {

using tests::Failing;
using tests::Memory;

/// What `call` gives in a thread of its own, which no call before has left memory to work in. Its requests are counted, and the `number`-th
/// fails, as Failing has it.
template <class Call>
auto called(Call&& call, long number, bool stays_out) {
  std::optional<decltype(call())> answer;
  std::jthread([&] {
    const Failing one(number, stays_out);
    answer.emplace(call());
  }).join();
  return std::move(*answer);
}

/// `call` gives an Expected. Each of many requests fails, alone and with all that follow. `growth`: how many are left out. `kept`: blocks
/// that threads which come and go may keep for their next work.
template <class Call, class Same>
void expect_error_or_the_same(Call&& call, Same&& same, double growth = 1.1, long kept = 0) {
  const auto whole = call();
  ASSERT_TRUE(whole) << whole.error().message;
  call();  // what is made once is there now
  static_cast<void>(called(call, 0, false));
  const long requests = Memory::asked;
  const long before = Memory::live;
  int failed = 0;
  for (const bool stays_out : {false, true}) {
    for (const long k : tests::places(requests, growth)) {
      SCOPED_TRACE(testing::Message() << "request " << k << " of " << requests << (stays_out ? " and all that follow" : ""));
      const long live = (kept > 0 ? before : Memory::live.load()) + kept;
      {
        const auto answer = called(call, k, stays_out);
        if (answer) {
          EXPECT_TRUE(same(*whole, *answer));
        } else {
          ++failed;
          EXPECT_EQ(answer.error().kind, Error::Kind::out_of_memory) << answer.error().message;
          EXPECT_FALSE(answer.error().message.empty());
        }
      }
      EXPECT_LE(Memory::live, live) << "blocks are lost";
      if (testing::Test::HasFailure()) return;
    }
  }
  EXPECT_GT(failed, 10);
  const auto again = call();
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_TRUE(same(*whole, *again));
}

bool same_fit(const FitResult& a, const FitResult& b) {
  if (a.labels != b.labels || a.models.size() != b.models.size()) return false;
  for (std::size_t m = 0; m < a.models.size(); ++m) {
    if (a.models[m].parameters != b.models[m].parameters) return false;
  }
  return true;
}

struct Case {
  ModelType type;
  std::size_t points;
  std::string backend = "cpu";
  int threads = 1;
  std::vector<ModelType> rivals = {};
  Noise noise = Noise::none;
  std::string name = std::string(swarmfit::name(type)) + "_" + backend + "_" + std::to_string(threads);
};

class FitOutOfMemory : public testing::TestWithParam<Case> {};

TEST_P(FitOutOfMemory, IsAnErrorAndTheFitterGoesOn) {
  const Case& c = GetParam();
  const std::vector<float> values = models::synthetic_points(c.type, c.points, 3);
  const PointsView points(std::span<const float>(values), dimension(c.type));
  FitOptions options;
  options.model = c.type;
  options.rivals = c.rivals;
  options.noise = c.noise;
  options.backend = c.backend;
  options.threads = c.threads;
  options.max_models = 3;
  auto fitter = Fitter::create(options);
  ASSERT_TRUE(fitter);
  const long kept = c.threads > 1 ? 100 : 0;
  expect_error_or_the_same([&] { return fitter->fit(points); }, same_fit, c.threads > 1 ? 1.6 : 1.1, kept);
  // What fails there is told by the fit: nothing may come out of it.
  for (const long request : {1, 2, 5, 20, 60, 200, 1000}) {
    for (const bool stays_out : {false, true}) {
      std::jthread([&] {
        const Failing one(request, stays_out);
        fitter->prepare();
      }).join();
    }
  }
  const auto after = fitter->fit(points), fresh = fit(points, options);
  ASSERT_TRUE(after && fresh);
  EXPECT_TRUE(same_fit(*after, *fresh));
  // Where threads are begun and ended each time, it is they that take the time.
  if (c.threads == 1) expect_error_or_the_same([&] { return fit(points, options); }, same_fit, 1.3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FitOutOfMemory,
                         testing::Values(Case{ModelType::line2d, 400}, Case{ModelType::line2d, 400, "cpu", 2},
                                         Case{ModelType::line2d, 200, "reference"}, Case{ModelType::plane, 20000},
                                         Case{ModelType::plane, 20000, "cpu", 2}, Case{ModelType::circle2d, 300},
                                         Case{ModelType::homography, 300}, Case{ModelType::fundamental, 300}),
                         [](const auto& one) { return one.param.name; });

TEST(OwnModelOutOfMemory, IsAnErrorAlsoInItsOwnFunctions) {
  using Doubles = std::span<const double>;
  OwnModel line;
  line.parameter_count = 3;
  line.minimal_sample = 2;
  line.freedom = 2;
  line.residual = [](Doubles points, Doubles p, std::span<double> residuals) {
    const std::vector<double> room(residuals.size());  // asks for memory of its own
    for (std::size_t i = 0; i < room.size(); ++i) residuals[i] = p[0] * points[2 * i] + p[1] * points[2 * i + 1] + p[2];
  };
  line.solve = [](Doubles q, std::span<double> p) {
    const double length = std::hypot(q[2] - q[0], q[3] - q[1]);
    if (!(length > 0)) return false;
    p[0] = (q[1] - q[3]) / length;
    p[1] = (q[2] - q[0]) / length;
    p[2] = -p[0] * q[0] - p[1] * q[1];
    return true;
  };
  const std::vector<float> values = models::synthetic_points(ModelType::line2d, 100, 3);
  const PointsView points(std::span<const float>(values), 2);
  FitOptions options;
  options.model = ModelType::own;
  options.own = line;
  options.backend = "cpu";
  options.threads = 1;
  options.threshold = 0.015;
  options.max_models = 2;
  expect_error_or_the_same([&] { return fit(points, options); }, same_fit, 1.3);
}

struct Clouds {
  std::vector<std::vector<float>> values;
  std::vector<PointsView> views;

  explicit Clouds(std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) values.push_back(models::synthetic_points(ModelType::line2d, 120, 100 + k));
    for (const auto& rows : values) views.emplace_back(std::span<const float>(rows), 2);
  }
};

FitOptions small_fit(int threads) {
  FitOptions options;
  options.model = ModelType::line2d;
  options.threshold = 0.015;
  options.max_models = 2;
  options.backend = "cpu";
  options.threads = threads;
  return options;
}

/// Each of its own: the same, or out of memory.
bool same_or_failed(const std::vector<Expected<FitResult>>& whole, const std::vector<Expected<FitResult>>& some) {
  for (std::size_t k = 0; k < whole.size(); ++k) {
    if (some[k] ? !same_fit(*whole[k], *some[k]) : some[k].error().kind != Error::Kind::out_of_memory) return false;
  }
  return whole.size() == some.size();
}

TEST(BatchOutOfMemory, IsOneCloudsErrorOrTheWholes) {
  const Clouds clouds(8);
  for (const int threads : {1, 3}) {
    expect_error_or_the_same([&] { return fit_batch(clouds.views, small_fit(threads)); }, same_or_failed, 1.3, 200);
  }
}

TEST(BatchOutOfMemory, InStepNobodyWaitsForOneThatCannotBegin) {
  const Clouds clouds(8);
  const FitOptions options = small_fit(1);
  kernels::EvaluatorOptions serial;
  serial.threads = 1;
  auto batch = kernels::make_batch_evaluator("cpu", serial, 5);
  ASSERT_TRUE(batch) << batch.error().message;
  const auto in_step = [&]() -> Expected<std::vector<Expected<FitResult>>> {
    try {
      std::vector<Expected<FitResult>> results(clouds.views.size());
      swarm::fit_in_step(clouds.views, options, 2, **batch, "asked for by name", results);
      return results;
    } catch (const std::bad_alloc&) {
      return fail(Error::Kind::out_of_memory, "thrown");
    }
  };
  expect_error_or_the_same(in_step, same_or_failed, 1.6, 100);
}

bool same_perception(const PerceiveResult& a, const PerceiveResult& b) {
  if (!same_fit(a.fit, b.fit) || a.popout != b.popout || a.objects != b.objects || a.sois.size() != b.sois.size()) return false;
  for (std::size_t k = 0; k < a.sois.size(); ++k) {
    if (a.sois[k].id != b.sois[k].id || a.sois[k].points != b.sois[k].points) return false;
  }
  for (std::size_t m = 0; m < a.fit.models.size(); ++m) {
    if (a.fit.models[m].id != b.fit.models[m].id) return false;
  }
  return true;
}

Cloud coloured_table() {
  Cloud frame =
      test::render_table({{{-0.2, 0, 0.1}, {0.08, 0.06, 0.1}, 0.3}, {{0.25, 0.1, 0.06}, {0.07, 0.07, 0.06}, 0}}, 0.001, 160, 120).cloud;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const auto shade = static_cast<std::uint8_t>(40 + i % 160);
    frame.rgb.insert(frame.rgb.end(), {shade, 90, 200});
  }
  return frame;
}

PerceiveOptions on_one_thread() {
  PerceiveOptions options;
  options.fit.backend = "cpu";
  options.fit.threads = 1;
  return options;
}

TEST(PerceiveOutOfMemory, IsAnError) {
  // OpenCV's threads keep what they have made once, and on a busy machine some come late: their blocks would look lost.
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  const Cloud frame = coloured_table();
  for (const Segmentation segmentation : {Segmentation::graphcut, Segmentation::fixation}) {
    PerceiveOptions options = on_one_thread();
    options.segmentation = segmentation;
    const auto whole = [&]() -> Expected<PerceiveResult> {
      auto perceiver = Perceiver::create(options);
      if (!perceiver) return tl::unexpected(perceiver.error());
      return perceiver->perceive(frame);
    };
    expect_error_or_the_same(whole, same_perception, 1.3, 100);
  }
}

TEST(PerceiveOutOfMemory, LeavesTracksAndTheVerticalAsTheyWere) {
  const Cloud frame = coloured_table();
  PerceiveOptions options = on_one_thread();
  options.track = true;
  // A frame is lost; the next is what it would have been without it.
  const auto with_a_loss = [&](long number) -> Expected<PerceiveResult> {
    auto perceiver = Perceiver::create(options);
    if (!perceiver) return tl::unexpected(perceiver.error());
    if (auto first = perceiver->perceive(frame); !first) return first;
    {
      const Failing one(number);
      if (number > 0 && perceiver->perceive(frame)) return fail(Error::Kind::bad_input, "not lost");
    }
    return perceiver->perceive(frame);
  };
  const auto whole = with_a_loss(0);
  ASSERT_TRUE(whole) << whole.error().message;
  ASSERT_FALSE(whole->sois.empty());
  for (const long k : tests::places(20000, 1.5)) {
    SCOPED_TRACE(k);
    const auto answer = with_a_loss(k);
    if (!answer && answer.error().message == "not lost") continue;
    ASSERT_TRUE(answer) << answer.error().message;
    EXPECT_TRUE(same_perception(*whole, *answer));
  }
}

bool same_cloud(const Cloud& a, const Cloud& b) { return a.size() == b.size() && a.width == b.width && a.rgb == b.rgb; }

TEST(ReadOutOfMemory, IsAnError) {
  const tests::TemporaryFolder folder;
  std::string rows;
  for (int k = 0; k < 200; ++k) rows += std::to_string(0.01 * k) + " " + std::to_string(k % 7) + " 1\n";
  std::string table = rows;
  std::replace(table.begin(), table.end(), ' ', ',');
  const std::string size = "WIDTH 200\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 200\nDATA ascii\n";
  const std::filesystem::path files[] = {
      folder.put("a.xyz", rows), folder.put("a.csv", table),
      folder.put("a.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n" + size + rows),
      folder.put("a.ply",
                 "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + rows)};
  for (const auto& file : files) {
    SCOPED_TRACE(file);
    expect_error_or_the_same([&] { return read_cloud(file); }, same_cloud);
  }
}

}  // namespace
}  // namespace swarmfit
