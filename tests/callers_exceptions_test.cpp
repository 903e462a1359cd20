// What a caller's own function throws comes back as it was, and what was called can be called again.
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <swarmfit/bench.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/perception.hpp>

#include "host/common/thrown.hpp"
#include "host/models/synthetic.hpp"
#include "tests/perception_fixture.hpp"

namespace swarmfit {
namespace {

/// No exception of the library's.
struct Mine {
  int number;
};

/// The number of the Mine that a call throws.
template <class Call>
std::optional<int> thrown_by(Call&& call) {
  try {
    call();
  } catch (const Mine& mine) {
    return mine.number;
  }
  return std::nullopt;
}

Verdict refuse(const Model&) { throw Mine{7}; }
void refuse_step(const SwarmStep& step) {
  if (step.step == 1) throw Mine{8};
}

TEST(CallersExceptions, PassThroughAFit) {
  const std::vector<float> values = models::synthetic_points(ModelType::plane, 20000, 3);
  const PointsView points(std::span<const float>(values), 3);
  for (const int threads : {1, 2}) {
    FitOptions options;
    options.backend = "cpu";
    options.threads = threads;
    auto fitter = Fitter::create(options);
    ASSERT_TRUE(fitter);
    const auto whole = fitter->fit(points);
    ASSERT_TRUE(whole);
    EXPECT_EQ(thrown_by([&] { (void)fitter->fit(points, refuse); }), 7);
    fitter->observe(refuse_step);
    EXPECT_EQ(thrown_by([&] { (void)fitter->fit(points); }), 8);
    fitter->observe({});
    // Also what the library would make an error of, were it its own.
    EXPECT_THROW((void)fitter->fit(points, [](const Model&) -> Verdict { throw std::bad_alloc(); }), std::bad_alloc);
    EXPECT_THROW((void)fitter->fit(points, [](const Model&) -> Verdict { throw std::runtime_error("a word"); }), std::runtime_error);
    const auto again = fitter->fit(points);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->labels, whole->labels);
    EXPECT_EQ(again->evaluations, whole->evaluations);
  }
}

TEST(CallersExceptions, PassThroughPerception) {
  const Cloud frame = test::render_table({{{-0.2, 0, 0.1}, {0.08, 0.06, 0.1}, 0.3}}).cloud;
  PerceiveOptions options;
  options.fit.backend = "cpu";
  options.track = true;
  auto perceiver = Perceiver::create(options);
  ASSERT_TRUE(perceiver);
  EXPECT_EQ(thrown_by([&] { (void)perceiver->perceive(frame, refuse); }), 7);
  perceiver->observe(refuse_step);
  EXPECT_EQ(thrown_by([&] { (void)perceiver->perceive(frame); }), 8);
  perceiver->observe({});
  const auto again = perceiver->perceive(frame);
  ASSERT_TRUE(again) << again.error().message;
  auto fresh = Perceiver::create(options);
  ASSERT_TRUE(fresh);
  const auto whole = fresh->perceive(frame);
  ASSERT_TRUE(whole);
  EXPECT_EQ(again->fit.labels, whole->fit.labels);
  EXPECT_EQ(again->popout, whole->popout);
  ASSERT_FALSE(again->sois.empty());
  EXPECT_EQ(again->sois.front().id, 1U) << "frames that were lost are no frames";
}

TEST(CallersExceptions, PassThroughTheBenchmark) {
  BenchOptions options;
  options.backends = {"cpu"};
  options.models = {ModelType::plane};
  options.points = {1000};
  options.particles = {8};
  options.seconds = 0.001;
  EXPECT_EQ(thrown_by([&] { (void)bench(options, nullptr, [](const std::string&) { throw Mine{9}; }); }), 9);
}

/// What a handler makes of an exception of the library's own.
template <class Thrown>
Error error_of(const Thrown& thrown) {
  const auto caught = [&]() -> Expected<> {
    try {
      throw thrown;
    } catch (...) {
      return common::error_of_thrown(Error::Kind::bad_input, [] { return std::string("no memory for 3 points"); });
    }
  };
  return caught().error();
}

TEST(LibrarysExceptions, BecomeErrors) {
  EXPECT_EQ(error_of(std::bad_alloc()).kind, Error::Kind::out_of_memory);
  EXPECT_EQ(error_of(std::bad_alloc()).message, "no memory for 3 points");
  EXPECT_EQ(error_of(std::length_error("vector")).kind, Error::Kind::out_of_memory);
  const Error thread = error_of(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)));
  EXPECT_EQ(thread.kind, Error::Kind::out_of_memory);
  EXPECT_EQ(thread.message, "no memory for 3 points: a thread cannot be started");
  EXPECT_EQ(error_of(std::system_error(std::make_error_code(std::errc::io_error))).kind, Error::Kind::bad_input);
  EXPECT_EQ(error_of(std::runtime_error("a word")).message, "a word");
  EXPECT_EQ(thrown_by([] { error_of(Mine{5}); }), 5) << "what is no std::exception goes on";
}

}  // namespace
}  // namespace swarmfit
