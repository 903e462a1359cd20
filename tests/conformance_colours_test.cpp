// The colour cost of every back end against the oracle's.
#include <algorithm>
#include <limits>
#include <map>

#include "conformance.hpp"
#include "kernels/colour_costs.hpp"

namespace swarmfit::kernels::conformance {
namespace {

struct Colours {
  std::vector<float> hue, lightness, saturation;
  ColoursView view() const { return {hue, lightness, saturation}; }
};

Colours make_colours(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Colours colours;
  for (std::size_t i = 0; i < count; ++i) {
    // Greys and hues at the circle's seam among them.
    colours.hue.push_back(i % 7 == 0 ? 0 : i % 7 == 1 ? 1 : static_cast<float>(random()));
    colours.lightness.push_back(static_cast<float>(random()));
    colours.saturation.push_back(i % 5 == 0 ? 0 : static_cast<float>(random()));
  }
  return colours;
}

Result<std::unique_ptr<ColourCosts>> make(const Contender& contender) {
  return make_colour_costs({contender.backend, ""}, false, contender.options);
}

class ConformanceColours : public Conformance {
 protected:
  void SetUp() override {
    Conformance::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    auto made = make(GetParam());
    if (!made) GTEST_FAIL() << made.error().message;
    costs_ = std::move(*made);
  }
  const ColourCosts& costs() const { return *costs_; }

 private:
  std::unique_ptr<ColourCosts> costs_;
};

TEST_P(ConformanceColours, AgreeWithTheOracle) {
  const auto oracle = make_reference_colour_costs();
  for (const std::size_t known : {1U, 2U, 15U, 16U, 17U, 128U, 512U}) {
    for (const std::size_t asked : {1U, 3U, 16U, 63U, 64U, 65U, 1000U}) {
      for (const int neighbours : {1, 5, 11, 64}) {
        const Colours sample = make_colours(known, known + 1), colours = make_colours(asked, asked + 77);
        Guarded<float> got(asked);
        std::vector<float> wanted(asked);
        ASSERT_OK(costs().evaluate(sample.view(), neighbours, colours.view(), got.span()));
        ASSERT_OK(oracle->evaluate(sample.view(), neighbours, colours.view(), wanted));
        EXPECT_TRUE(got.intact());
        double worst = 0;
        for (std::size_t i = 0; i < asked; ++i)
          worst = std::max(worst, std::abs(static_cast<double>(got[i]) - static_cast<double>(wanted[i])));
        EXPECT_LE(worst, kColourTolerance) << known << " known, " << asked << " asked for, " << neighbours << " nearest";
        note_error(GetParam().name, "colours", worst);
      }
    }
  }
}

TEST_P(ConformanceColours, OfAnEmptySampleIsOneAndOfNothingIsNothing) {
  const Colours none, some = make_colours(20, 3);
  std::vector<float> got(20, 0);
  ASSERT_OK(costs().evaluate(none.view(), 4, some.view(), got));
  EXPECT_EQ(got, std::vector<float>(20, 1));
  ASSERT_OK(costs().evaluate(some.view(), 4, none.view(), {}));
}

TEST_P(ConformanceColours, BoundsAreChecked) {
  const Colours some = make_colours(20, 3);
  std::vector<float> got(20), few(19);
  EXPECT_TRUE(is_invalid(costs().evaluate(some.view(), 0, some.view(), got), {"neighbours", "0", "[1, 64]"}));
  EXPECT_TRUE(is_invalid(costs().evaluate(some.view(), 65, some.view(), got), {"neighbours", "65", "[1, 64]"}));
  EXPECT_TRUE(is_invalid(costs().evaluate(some.view(), 4, some.view(), few), {"costs.size()", "19", "20"}));
  Colours torn = some;
  torn.hue.pop_back();
  EXPECT_TRUE(is_invalid(costs().evaluate(torn.view(), 4, some.view(), got), {"sample", "19 hues"}));
}

INSTANTIATE_TEST_SUITE_P(Backends, ConformanceColours, testing::ValuesIn(contenders()), contender_name);

}  // namespace
}  // namespace swarmfit::kernels::conformance
