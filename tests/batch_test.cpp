// Many small clouds in one call: each answer is that of its own call.
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/batch.hpp>

#include "host/models/synthetic.hpp"
#include "host/swarm/lock_step.hpp"
#include "tests/same_answer.hpp"

namespace swarmfit {
namespace {

constexpr std::size_t kPoints = 300;

struct Problems {
  std::vector<std::vector<float>> values;
  std::vector<PointsView> views;

  explicit Problems(std::size_t count, ModelType type = ModelType::line2d) {
    for (std::size_t k = 0; k < count; ++k) values.push_back(models::synthetic_points(type, kPoints, 100 + k));
    for (const auto& rows : values) views.emplace_back(std::span<const float>(rows), dimension(type));
  }
};

FitOptions small_fit(int threads, std::string backend = "cpu") {
  FitOptions options;
  options.model = ModelType::line2d;
  options.threshold = 0.015;
  options.backend = std::move(backend);
  options.threads = threads;
  return options;
}

void expect_same(const Expected<FitResult>& one, const Expected<FitResult>& other) {
  ASSERT_TRUE(one && other);
  tests::expect_same_answer(*one, *other);
}

TEST(Batch, GivesWhatEachCallGivesOnAnyNumberOfThreads) {
  const Problems problems(150);
  std::vector<Expected<FitResult>> alone;
  std::size_t models = 0;
  for (const PointsView& cloud : problems.views) {
    alone.push_back(fit(cloud, small_fit(1)));
    ASSERT_TRUE(alone.back()) << alone.back().error().message;
    models += alone.back()->models.size();
  }
  EXPECT_GT(models, 2 * problems.views.size());
  for (const int threads : {0, 1, 2, 4}) {
    const auto together = fit_batch(problems.views, small_fit(threads));
    ASSERT_TRUE(together) << together.error().message;
    ASSERT_EQ(together->size(), alone.size());
    for (std::size_t k = 0; k < alone.size(); ++k) expect_same(alone[k], (*together)[k]);
  }
}

TEST(Batch, HoldsOnOtherBackEnds) {
  const Problems problems(3);
  for (const char* backend : {"reference", "vulkan"}) {
    const auto together = fit_batch(problems.views, small_fit(0, backend));
    if (!together && together.error().kind == Error::Kind::backend_unavailable) continue;
    ASSERT_TRUE(together) << together.error().message;
    for (std::size_t k = 0; k < problems.views.size(); ++k) expect_same(fit(problems.views[k], small_fit(0, backend)), (*together)[k]);
  }
}

/// Forty clouds of all sizes, among them an empty one, one with points that are not finite, one of another dimension and one that is
/// too large for a batch.
struct Awkward : Problems {
  explicit Awkward(ModelType type) : Problems(40, type) {
    const auto width = static_cast<std::size_t>(dimension(type));
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k].resize((40 + 6 * k) * width);
      views[k] = PointsView(std::span<const float>(values[k]), dimension(type));
    }
    views[5] = PointsView(std::span<const float>(), dimension(type));
    for (std::size_t i = 0; i < 20 * width; i += 3) values[11][i] = std::numeric_limits<float>::quiet_NaN();
    views[17] = PointsView(std::span<const float>(values[17]).first(40 * 4), 4);
    values[23] = models::synthetic_points(type, 17000, 7);
    views[23] = PointsView(std::span<const float>(values[23]), dimension(type));
  }
};

void expect_each_as_alone(const Problems& problems, const FitOptions& options, const std::vector<Expected<FitResult>>& together) {
  ASSERT_EQ(together.size(), problems.views.size());
  auto alone = Fitter::create(options);
  ASSERT_TRUE(alone) << alone.error().message;
  for (std::size_t k = 0; k < problems.views.size(); ++k) {
    SCOPED_TRACE("cloud " + std::to_string(k));
    const auto expected = alone->fit(problems.views[k]);
    if (expected) {
      expect_same(expected, together[k]);
      EXPECT_EQ(expected->backend.reason, together[k]->backend.reason);
    } else {
      ASSERT_FALSE(together[k]);
      EXPECT_EQ(expected.error().kind, together[k].error().kind);
      EXPECT_EQ(expected.error().message, together[k].error().message);
    }
  }
}

TEST(Batch, OnADeviceInStepGivesWhatEachCallGives) {
  for (const ModelType type : {ModelType::line2d, ModelType::plane}) {
    SCOPED_TRACE(name(type));
    const Awkward problems(type);
    FitOptions options = small_fit(0, "vulkan");
    options.model = type;
    const auto together = fit_batch(problems.views, options);
    if (!together && together.error().kind == Error::Kind::backend_unavailable) GTEST_SKIP() << together.error().message;
    ASSERT_TRUE(together) << together.error().message;
    expect_each_as_alone(problems, options, *together);
    options.threads = 1;
    const auto again = fit_batch(problems.views, options);
    ASSERT_TRUE(again) << again.error().message;
    for (std::size_t k = 0; k < problems.views.size(); ++k) {
      if ((*together)[k]) expect_same((*together)[k], (*again)[k]);
    }
  }
}

/// In step on any back end: fewer problems than clouds, so that some come in when others are done.
TEST(Batch, InStepIsFewSubmissions) {
  const Problems problems(40);
  for (const char* backend : {"cpu", "vulkan"}) {
    SCOPED_TRACE(backend);
    const FitOptions options = small_fit(1, backend);
    auto batch = kernels::make_batch_evaluator(backend, {}, 16);
    if (!batch && batch.error().kind == kernels::Failure::Kind::unavailable) continue;
    ASSERT_TRUE(batch) << batch.error().message;
    for (const int threads : {1, 3}) {
      std::vector<Expected<FitResult>> together(problems.views.size());
      const auto told = swarm::fit_in_step(problems.views, options, threads, **batch, "asked for by name", together);
      expect_each_as_alone(problems, options, together);
      std::size_t evaluations = 0;
      for (const auto& one : together) evaluations += one ? one->evaluations : 0;
      EXPECT_GT(told.swarms, 1000U);
      EXPECT_GE(evaluations, told.swarms);
      // Sixteen are under way until few are left.
      EXPECT_LT(12 * told.submissions, told.swarms);
    }
  }
}

TEST(Batch, WithATimeBudgetGoesOneAfterAnother) {
  const Problems problems(3);
  FitOptions options = small_fit(0, "vulkan");
  options.time_budget_ms = 60000;
  const auto together = fit_batch(problems.views, options);
  if (!together && together.error().kind == Error::Kind::backend_unavailable) GTEST_SKIP() << together.error().message;
  ASSERT_TRUE(together) << together.error().message;
  expect_each_as_alone(problems, options, *together);
}

TEST(Batch, KeepsOneCloudsFailureToItself) {
  Problems problems(20);
  problems.views[3] = PointsView(std::span<const float>(problems.values[3]).first(2), 2);
  problems.views[7] = PointsView(std::span<const float>(problems.values[7]), 3);
  problems.views[19] = PointsView();
  const auto together = fit_batch(problems.views, small_fit(2));
  ASSERT_TRUE(together) << together.error().message;
  for (std::size_t k = 0; k < problems.views.size(); ++k) {
    const bool bad = k == 3 || k == 7 || k == 19;
    ASSERT_EQ((*together)[k].has_value(), !bad) << k;
    if (bad) {
      EXPECT_EQ((*together)[k].error().kind, Error::Kind::bad_input) << k;
      continue;
    }
    expect_same(fit(problems.views[k], small_fit(1)), (*together)[k]);
  }
}

TEST(Batch, OfNothingIsNothingAndOfWrongOptionsAFailure) {
  const auto nothing = fit_batch({}, small_fit(0));
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->empty());
  const Problems problems(2);
  FitOptions wrong = small_fit(-1);
  const auto refused = fit_batch(problems.views, wrong);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "threads is -1, must be in [0, 4096]");
  const auto absent = fit_batch(problems.views, small_fit(0, "abacus"));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, Error::Kind::backend_unavailable);
}

}  // namespace
}  // namespace swarmfit
