// The report's data: what is encoded can be read back, what is left out is little, and watching a search changes nothing.
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>
#include <swarmfit/report.hpp>
#include <swarmfit/scene.hpp>

#include "host/report/cost_maps.hpp"
#include "host/report/encode.hpp"
#include "host/report/search_json.hpp"

namespace {

using namespace swarmfit;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<std::uint64_t> read_varints(const report::Bytes& bytes) {
  std::vector<std::uint64_t> values;
  std::uint64_t value = 0;
  int shift = 0;
  for (const std::uint8_t byte : bytes) {
    value |= static_cast<std::uint64_t>(byte & 127U) << shift;
    shift += 7;
    if (byte < 128) {
      values.push_back(value);
      value = 0;
      shift = 0;
    }
  }
  return values;
}

TEST(ReportData, Base64IsThatOfTheStandard) {
  // RFC 4648, section 10.
  const std::pair<const char*, const char*> vectors[] = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}, {"fooba", "Zm9vYmE="}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, encoded] : vectors) {
    const std::string text = plain;
    EXPECT_EQ(report::base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}), encoded);
  }
}

TEST(ReportData, LabelsComeBackFromTheirRuns) {
  std::mt19937 random(3);
  std::vector<std::uint16_t> labels;
  for (int run = 0; run < 200; ++run) labels.insert(labels.end(), 1 + random() % 400, static_cast<std::uint16_t>(random()));
  const auto values = read_varints(report::runs(labels));
  std::vector<std::uint16_t> back;
  for (std::size_t k = 0; k + 1 < values.size(); k += 2) back.insert(back.end(), values[k + 1], static_cast<std::uint16_t>(values[k]));
  EXPECT_EQ(back, labels);
  EXPECT_TRUE(report::runs({}).empty());
}

TEST(ReportData, IndicesComeBackFromTheirDifferences) {
  const std::vector<std::uint32_t> index = {0, 1, 2, 130, 131, 70000, 4'000'000'000U};
  std::uint64_t sum = 0;
  std::vector<std::uint32_t> back;
  for (const std::uint64_t step : read_varints(report::differences(index))) back.push_back(static_cast<std::uint32_t>(sum += step));
  EXPECT_EQ(back, index);
}

TEST(ReportData, PositionsAreRoundedToAPartOfTheExtentAndPointsThatAreNotFiniteLeftOut) {
  Cloud cloud;
  cloud.values32 = {0, -5, 1e6F, kNan, 0, 0, 1, 5, 1e6F, 0.25F, 1, 1e6F};
  cloud.width = 4;
  cloud.height = 1;
  const report::Shown shown = report::choose_points(cloud, 100);
  EXPECT_EQ(shown.index, (std::vector<std::uint32_t>{0, 2, 3}));
  EXPECT_EQ(shown.every, 1);
  const report::Quantised q = report::quantise(cloud, shown.index);
  ASSERT_EQ(q.bytes.size(), 3U * 3 * 2);
  for (std::size_t k = 0; k < shown.index.size(); ++k) {
    for (std::size_t d = 0; d < 3; ++d) {
      const double level = q.bytes[2 * (3 * k + d)] + 256.0 * q.bytes[2 * (3 * k + d) + 1];
      const double span = q.high[d] - q.low[d];
      EXPECT_NEAR(q.low[d] + span * level / 65535, static_cast<double>(cloud.values32[3 * shown.index[k] + d]), span / 65535);
    }
  }
}

TEST(ReportData, TheLargestDoublesAndACloudOfNoFinitePointAreEncoded) {
  Cloud cloud;
  const double most = std::numeric_limits<double>::max();
  cloud.values64 = {-most, 0, 0, most, 0, 0};
  cloud.width = 2;
  cloud.height = 1;
  const report::Quantised q = report::quantise(cloud, report::choose_points(cloud, 10).index);
  EXPECT_EQ((std::vector<int>{q.bytes[0], q.bytes[1], q.bytes[6], q.bytes[7]}), (std::vector<int>{0, 0, 255, 255}));
  cloud.values64.assign(6, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(report::choose_points(cloud, 10).index.empty());
  EXPECT_TRUE(report::quantise(cloud, {}).bytes.empty());
}

TEST(ReportData, LargeCloudsAreThinnedEvenly) {
  Cloud cloud;
  cloud.values32.assign(3 * 1001, 1.0F);
  cloud.width = 1001;
  cloud.height = 1;
  const report::Shown some = report::choose_points(cloud, 300);
  EXPECT_EQ(some.every, 4);
  ASSERT_EQ(some.index.size(), 251U);
  EXPECT_EQ(some.index.back(), 1000U);
  cloud.values32.assign(3 * 40 * 30, 1.0F);
  cloud.width = 40;
  cloud.height = 30;
  const report::Shown grid = report::choose_points(cloud, 300);
  EXPECT_EQ(grid.every, 2);
  EXPECT_EQ(grid.index.size(), 300U);
  EXPECT_EQ(grid.index[20], 80U) << "the third row";
}

SwarmStep step_of(std::size_t number, Eigen::Index particles) {
  SwarmStep step;
  step.step = number;
  step.positions = Eigen::MatrixXd::Constant(4, particles, static_cast<double>(number));
  step.fitness.assign(static_cast<std::size_t>(particles), 1.0);
  step.best = step.positions.col(0);
  step.nothing_explained = 2;
  return step;
}

TEST(SearchRecord, StaysSmallHoweverLongTheSearchIs) {
  SearchRecord record;
  for (std::size_t k = 0; k < 10'000; ++k) {
    record.add(step_of(k, 200));
    if (k == 5000) record.add(Model{});
  }
  EXPECT_LE(record.steps().size(), 1500U);
  EXPECT_GT(record.steps().size(), 700U);
  EXPECT_EQ(record.particles(), 200U);
  for (std::size_t k = 0; k < record.steps().size(); ++k) {
    ASSERT_EQ(record.steps()[k].step, k * record.every());
    ASSERT_EQ(record.steps()[k].positions.cols(), 64);
    ASSERT_EQ(record.steps()[k].fitness.size(), 64U);
  }
  ASSERT_EQ(record.found().size(), 1U);
  EXPECT_NEAR(static_cast<double>(record.found()[0].after), 5001.0 / static_cast<double>(record.every()), 1.0);
}

TEST(SearchRecord, IsReplayedAboutTheMiddleOfTheCloud) {
  SearchRecord record;
  SwarmStep step = step_of(0, 1);
  step.best = step.positions.col(0) = Eigen::Vector4d(0, 0, 1, -1000);
  step.fitness = {1.5};
  record.add(step);
  Model found;
  found.parameters = step.best;
  found.found_at_ms = 7;
  record.add(found);
  const report::Replay replay = report::replay(record, {found}, {0, 0, 999});
  EXPECT_EQ(replay.steps["steps"][0]["best"], (std::vector<double>{0, 0, 1, -1}));
  EXPECT_EQ(replay.steps["steps"][0]["shares"], (std::vector<int>{250}));
  EXPECT_EQ(replay.steps["found"][0]["model"], 1);
  EXPECT_EQ(replay.steps["found"][0]["after"], 1);
  EXPECT_EQ(replay.particles.size(), 4 * sizeof(float));
}

TEST(Observer, SeesEveryStepAndChangesNothing) {
  const Scene scene = make_room_scene(1, 160, 120);
  FitOptions options;
  options.backend = "cpu";
  auto fitter = Fitter::create(options);
  ASSERT_TRUE(fitter) << fitter.error().message;
  const auto alone = fitter->fit(scene.cloud.points());
  ASSERT_TRUE(alone) << alone.error().message;
  std::size_t steps = 0, of_swarm = 0, swarm = 0;
  double before = std::numeric_limits<double>::infinity();
  fitter->observe([&](const SwarmStep& step) {
    ++steps;
    if (step.step == 0) {
      of_swarm = 0;
      before = std::numeric_limits<double>::infinity();
    }
    EXPECT_EQ(step.step, of_swarm++);
    EXPECT_GE(step.swarm, swarm);
    swarm = step.swarm;
    EXPECT_EQ(static_cast<std::size_t>(step.positions.cols()), step.fitness.size());
    EXPECT_EQ(step.positions.rows(), 4);
    EXPECT_NEAR(step.best.head<3>().norm(), 1, 1e-9);
    EXPECT_LE(step.best_fitness, before);
    before = step.best_fitness;
    for (const double f : step.fitness) EXPECT_GE(f, step.best_fitness * (1 - 1e-4));
  });
  const auto watched = fitter->fit(scene.cloud.points());
  ASSERT_TRUE(watched) << watched.error().message;
  EXPECT_EQ(watched->labels, alone->labels);
  EXPECT_EQ(watched->evaluations, alone->evaluations);
  EXPECT_GE(steps, watched->iterations) << "steps of swarms that found nothing are told, too";
  fitter->observe({});
  const std::size_t told = steps;
  ASSERT_TRUE(fitter->fit(scene.cloud.points()));
  EXPECT_EQ(steps, told);
}

TEST(Observer, OfAPerceiverIsToldOfPlanesInTheFrameOfTheCloud) {
  Scene scene = make_room_scene(1, 320, 240);
  PerceiveOptions options;
  options.fit.backend = "cpu";
  auto perceiver = Perceiver::create(options);
  ASSERT_TRUE(perceiver) << perceiver.error().message;
  std::vector<Eigen::VectorXd> bests;
  perceiver->observe([&](const SwarmStep& step) { bests.push_back(step.best); });
  const auto seen = perceiver->perceive(scene.cloud);
  ASSERT_TRUE(seen) << seen.error().message;
  ASSERT_FALSE(seen->fit.models.empty());
  for (const Model& plane : seen->fit.models) {
    const bool near = std::any_of(bests.begin(), bests.end(), [&](const Eigen::VectorXd& best) {
      const double sign = best.head<3>().dot(plane.normal()) < 0 ? -1 : 1;
      return (sign * best - plane.parameters).norm() < 0.05;
    });
    EXPECT_TRUE(near) << plane.parameters.transpose();
  }
}

TEST(CostMaps, ThingsCostLessAsObjectThanAsBackgroundAndTheRestIsNotLookedAt) {
  const Scene scene = make_room_scene(1, 320, 240);
  PerceiveOptions options;
  options.fit.backend = "cpu";
  auto perceiver = Perceiver::create(options);
  ASSERT_TRUE(perceiver) << perceiver.error().message;
  const auto seen = perceiver->perceive(scene.cloud);
  ASSERT_TRUE(seen) << seen.error().message;
  const report::CostMaps maps = report::cost_maps(*seen, scene.cloud);
  ASSERT_EQ(maps.object.size(), cv::Size(320, 240));
  ASSERT_EQ(maps.background.size(), maps.object.size());
  double object = 0, background = 0;
  std::size_t on_things = 0, outside = 0;
  for (std::size_t i = 0; i < seen->popout.size(); ++i) {
    const int v = static_cast<int>(i) / 320, u = static_cast<int>(i) % 320;
    EXPECT_EQ(maps.object(v, u) == 0, maps.background(v, u) == 0);
    if (seen->popout[i] > 0) {
      EXPECT_GT(maps.object(v, u), 0);
      ++on_things;
      object += maps.object(v, u);
      background += maps.background(v, u);
    } else if (maps.object(v, u) == 0) {
      ++outside;
    }
  }
  EXPECT_LT(object, background);
  EXPECT_GT(on_things, 1000U);
  EXPECT_GT(outside, 10000U);

  Cloud grey = scene.cloud;
  grey.rgb.clear();
  EXPECT_TRUE(report::cost_maps(*seen, grey).object.empty());
}

TEST(ReportPage, HoldsItsDataAndNothingThatACloudsNameCouldEnd) {
  if (const auto can = check_report(); !can) {
    EXPECT_EQ(can.error().kind, Error::Kind::cannot_write);
    GTEST_SKIP() << can.error().message;
  }
  const Scene scene = make_room_scene(1, 160, 120);
  PerceiveOptions options;
  options.fit.backend = "cpu";
  auto perceiver = Perceiver::create(options);
  ASSERT_TRUE(perceiver);
  const auto seen = perceiver->perceive(scene.cloud);
  ASSERT_TRUE(seen);
  ReportNotes notes;
  notes.title = "</script><b>bold";
  notes.settings = {{"--seed", "\xff", true}};  // no UTF-8
  const auto page = report_page(*seen, scene.cloud, {}, notes);
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_TRUE(page->starts_with("<!doctype html>"));
  EXPECT_TRUE(page->ends_with("</html>\n"));
  EXPECT_EQ(page->find("<b>bold"), std::string::npos);
  EXPECT_EQ(page->find("<!--data-->"), std::string::npos);
  const std::string mark = "<script type=\"application/json\" id=\"about\">";
  const std::size_t first = page->find(mark) + mark.size();
  const auto about = nlohmann::json::parse(page->substr(first, page->find("</script>", first) - first));
  EXPECT_EQ(about["title"], notes.title);
  EXPECT_EQ(about["kind"], "perceive");
  EXPECT_EQ(about["image"]["width"], 160);
  for (const char* id : {"points", "points-index", "points-rgb", "image-jpeg", "image-objects", "search", "result"})
    EXPECT_NE(page->find(std::string("id=\"") + id + "\""), std::string::npos) << id;
}

}  // namespace
