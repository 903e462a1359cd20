// The benchmark's own honesty: what it reports, what it refuses, and that its cases are what it says. Never how fast anything is.
#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <swarmfit/bench.hpp>
#include <swarmfit/points.hpp>

#include "host/bench/bench_case.hpp"
#include "host/models/synthetic.hpp"
#include "kernels/machine_limit.hpp"

namespace swarmfit {
namespace {

BenchOptions small() {
  BenchOptions options;
  options.backends = {"cpu", "reference"};
  options.points = {300, 5000};
  options.particles = {8};
  options.pruning = {false, true};
  options.seconds = 1e-3;
  return options;
}

TEST(Bench, OneRowForEachCombination) {
  std::size_t told = 0;
  const auto report = bench(small(), nullptr, [&](const std::string&) { ++told; });
  ASSERT_TRUE(report) << report.error().message;
  ASSERT_EQ(report->rows.size(), 2U * 2U * 1U * 2U * model_types().size());
  EXPECT_EQ(told, report->rows.size());
  std::set<std::string> seen;
  for (const BenchRow& row : report->rows) {
    seen.insert(row.backend + row.model + std::to_string(row.points) + (row.pruning ? "p" : "b"));
    EXPECT_GT(row.seconds, 0);
    EXPECT_NEAR(row.evaluations_per_s * row.seconds, static_cast<double>(row.points * row.particles), 1e-6 * row.evaluations_per_s);
    EXPECT_GT(row.fraction_of_limit, 0);
    EXPECT_LE(row.max_relative_error, 1e-5);
    if (row.backend == "reference") {
      EXPECT_EQ(row.max_relative_error, 0);
    }
  }
  EXPECT_EQ(seen.size(), report->rows.size());
  EXPECT_GT(report->fma_per_s, 1e6);
  EXPECT_GE(report->threads, 1);
}

TEST(Bench, JsonHoldsTheAgreedFields) {
  BenchReport report;
  report.fma_per_s = 1e11;
  report.threads = 2;
  report.rows.push_back({"cpu", "AVX2, 2 threads", "plane", 1000, 64, true, 2e10, 0.6, 1e-7, 3.2e-6});
  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(json.at("schema"), 1);
  EXPECT_EQ(json.at("limit").at("fma_per_s"), 1e11);
  EXPECT_EQ(json.at("limit").at("threads"), 2);
  ASSERT_EQ(json.at("results").size(), 1U);
  const auto& row = json.at("results")[0];
  EXPECT_EQ(row.size(), 10U);
  EXPECT_EQ(row.at("backend"), "cpu");
  EXPECT_EQ(row.at("device"), "AVX2, 2 threads");
  EXPECT_EQ(row.at("model"), "plane");
  EXPECT_EQ(row.at("points"), 1000);
  EXPECT_EQ(row.at("particles"), 64);
  EXPECT_EQ(row.at("pruning"), true);
  EXPECT_EQ(row.at("evaluations_per_s"), 2e10);
  EXPECT_EQ(row.at("fraction_of_limit"), 0.6);
  EXPECT_EQ(row.at("max_relative_error"), 1e-7);
  EXPECT_EQ(row.at("seconds"), 3.2e-6);
}

void expect_refused(BenchOptions options, Error::Kind kind, const std::string& field, const std::string& value) {
  const auto report = bench(options);
  ASSERT_FALSE(report) << field;
  EXPECT_EQ(report.error().kind, kind);
  EXPECT_NE(report.error().message.find(field), std::string::npos) << report.error().message;
  EXPECT_NE(report.error().message.find(value), std::string::npos) << report.error().message;
}

TEST(Bench, RefusesOptionsOutOfBounds) {
  const auto with = [](auto&& change) {
    BenchOptions options = small();
    change(options);
    return options;
  };
  expect_refused(with([](BenchOptions& o) { o.points = {0}; }), Error::Kind::invalid_option, "points", "0");
  expect_refused(with([](BenchOptions& o) { o.particles = {1}; }), Error::Kind::invalid_option, "particles", "1");
  EXPECT_TRUE(BenchOptions{}.validate());
  expect_refused(with([](BenchOptions& o) { o.threads = -1; }), Error::Kind::invalid_option, "threads", "-1");
  expect_refused(with([](BenchOptions& o) { o.seconds = 0; }), Error::Kind::invalid_option, "seconds", "0");
  expect_refused(with([](BenchOptions& o) { o.seconds = std::numeric_limits<double>::quiet_NaN(); }), Error::Kind::invalid_option,
                 "seconds", "nan");
  expect_refused(with([](BenchOptions& o) { o.pruning.clear(); }), Error::Kind::invalid_option, "pruning", "empty");
  expect_refused(with([](BenchOptions& o) { o.backends = {"abacus"}; }), Error::Kind::backend_unavailable, "backend", "abacus");
}

TEST(Bench, RefusesACloudOfAnotherDimension) {
  const std::vector<float> values(30, 1.0F);
  const PointsView cloud(std::span<const float>(values), 3);
  BenchOptions options = small();
  options.models = {ModelType::line2d};
  const auto report = bench(options, &cloud);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, Error::Kind::bad_input);
}

TEST(Bench, TakesTheCloudItIsGiven) {
  const std::vector<float> values = models::synthetic_points(ModelType::plane, 777, 5);
  const PointsView cloud(std::span<const float>(values), 3);
  const auto report = bench(small(), &cloud);
  ASSERT_TRUE(report) << report.error().message;
  // Four rows of each kind of three columns that planes with noise determine; planes are among them.
  ASSERT_GE(report->rows.size(), 4U);
  EXPECT_EQ(report->rows.size() % 4, 0U);
  EXPECT_EQ(report->rows.front().model, "plane");
  for (const BenchRow& row : report->rows) {
    EXPECT_EQ(row.points, 777U);
    EXPECT_EQ(dimension(*model_type(row.model)), 3) << row.model;
  }
}

TEST(Bench, CountsFinitePointsAlone) {
  std::vector<float> values = models::synthetic_points(ModelType::plane, 900, 5);
  for (std::size_t i = 0; i < 300; ++i) values[9 * i + i % 3] = std::numeric_limits<float>::quiet_NaN();
  const PointsView cloud(std::span<const float>(values), 3);
  BenchOptions options = small();
  options.models = {ModelType::plane};
  const auto report = bench(options, &cloud);
  ASSERT_TRUE(report) << report.error().message;
  for (const BenchRow& row : report->rows) {
    EXPECT_EQ(row.points, 600U);
    EXPECT_NEAR(row.evaluations_per_s * row.seconds, 600.0 * static_cast<double>(row.particles), 1e-6 * 600);
  }
}

TEST(BenchCase, HoldsTheStepsOfASwarm) {
  const std::vector<float> values = models::synthetic_points(ModelType::line2d, 1000, 3);
  const PointsView points(std::span<const float>(values), 2);
  const auto made = bench_internal::make_case(ModelType::line2d, points, 16, 3, 1);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_GT(made->steps.size(), 1U);
  for (const auto& step : made->steps) {
    EXPECT_EQ(step.parameters.size(), 16U * 3U);
    EXPECT_EQ(step.cutoffs.size(), 16U);
  }
  EXPECT_NE(made->steps.front().parameters, made->steps.back().parameters);
  EXPECT_EQ(made->steps.front().reference.size(), 16U);
  EXPECT_EQ(made->steps.back().reference.size(), 16U);
  // The swarm has found better places than it was born in.
  const auto best = [](const std::vector<float>& costs) { return *std::min_element(costs.begin(), costs.end()); };
  EXPECT_LE(best(made->steps.back().cutoffs), best(made->steps.front().reference) * (1 + 1e-5F));
}

TEST(MachineLimit, RefusesWhatItCannotMeasure) {
  EXPECT_FALSE(kernels::measure_machine_limit(-1, 0.01));
  EXPECT_FALSE(kernels::measure_machine_limit(1, 0));
  const auto limit = kernels::measure_machine_limit(3, 1e-3);
  ASSERT_TRUE(limit);
  EXPECT_EQ(limit->threads, 3);
  EXPECT_GT(limit->fma_per_s, 0);
}

}  // namespace
}  // namespace swarmfit
