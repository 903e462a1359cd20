// Sums and marks over distances that are known, on every instruction set, against plain loops.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/cpu/tally_kernels.hpp"

namespace swarmfit::kernels {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kWidth = 0.01F;

struct Values {
  std::vector<float> distances, caps, others;
  std::vector<std::uint8_t> marks;
};

/// Every sort of point: near and far, open and not, NaN, at the very edges of slabs.
Values make_values(std::size_t n) {
  std::mt19937 random(static_cast<unsigned>(n) + 1);
  std::uniform_real_distribution<float> unit(0, 1);
  Values v;
  for (std::size_t i = 0; i < n; ++i) {
    const float far = unit(random) < 0.5F ? kWidth * unit(random) : 10 * kWidth * unit(random);
    v.distances.push_back(unit(random) < 0.1F ? kNaN : unit(random) < 0.1F ? kWidth * std::floor(9 * unit(random)) : far);
    v.caps.push_back(unit(random) < 0.4F ? 0 : kWidth * unit(random));
    v.others.push_back(unit(random) < 0.3F ? std::numeric_limits<float>::infinity() : 2 * kWidth * unit(random));
    v.marks.push_back(unit(random) < 0.3F ? 1 : 0);
  }
  return v;
}

SlabCounts count_plainly(const SlabsView& view) {
  SlabCounts counts;
  for (std::size_t i = 0; i < view.distances.size(); ++i) {
    const float d = view.distances[i];
    const bool open = view.caps[i] >= view.least_cap && !std::isnan(d);
    counts.open += open;
    counts.shared += !open && !view.others.empty() && d < view.width && view.others[i] < view.width && d < view.others[i];
    const float slab = d * (1 / view.width);
    if (!open || !(d < static_cast<float>(SlabCounts::kSlabs) * view.width) || !(slab < static_cast<float>(SlabCounts::kSlabs))) continue;
    ++counts.slabs[static_cast<std::size_t>(slab)];
    if (slab >= 1) continue;
    counts.square += static_cast<double>(d) * static_cast<double>(d);
    counts.inner += d < 0.5F * view.width;
    counts.marked += view.marks.empty() ? 0 : view.marks[i];
  }
  return counts;
}

class Tallies : public testing::TestWithParam<const cpu::TallyKernels*> {};

TEST_P(Tallies, SlabsAreCountedAsByAPlainLoop) {
  for (const std::size_t n : {0, 1, 3, 15, 16, 17, 64, 100, 5003}) {
    const Values v = make_values(n);
    for (const bool all : {false, true}) {
      SCOPED_TRACE(n);
      SlabsView view{v.distances, v.caps, {}, {}, kWidth, 0.5F * kWidth};
      if (all) {
        view.marks = v.marks;
        view.others = v.others;
      }
      const SlabCounts exact = count_plainly(view);
      SlabCounts found;
      GetParam()->count_slabs(view, found);
      EXPECT_EQ(found.open, exact.open);
      EXPECT_EQ(found.slabs, exact.slabs);
      EXPECT_EQ(found.inner, exact.inner);
      EXPECT_EQ(found.marked, exact.marked);
      EXPECT_EQ(found.shared, exact.shared);
      EXPECT_NEAR(found.square, exact.square, 1e-12 * exact.square);
      const SlabCounts once = found;
      GetParam()->count_slabs(view, found);
      EXPECT_EQ(found.open, 2 * once.open) << "counts are added to";
      EXPECT_EQ(found.slabs[0], 2 * once.slabs[0]);
    }
  }
}

void sink_plainly(const Sinking& how, bool marks, bool others, Values& v) {
  for (std::size_t i = 0; i < v.distances.size(); ++i) {
    const float d = v.distances[i], width = how.widths.empty() ? how.width : how.widths[i];
    const float levelled = how.widths.empty() ? d : d * (how.width / width);
    const float left = how.slope * (d - (how.reaches.empty() ? how.reach : how.reaches[i]) * width);
    if (marks && levelled < how.marked * how.width) v.marks[i] = 1;
    if (others && levelled < v.others[i]) v.others[i] = levelled;
    if (left < v.caps[i]) v.caps[i] = std::max(left, 0.0F);
  }
}

TEST_P(Tallies, WhatAFoundModelLeavesIsThatOfAPlainLoop) {
  for (const std::size_t n : {0, 1, 15, 16, 17, 5003}) {
    const Values values = make_values(n);
    std::vector<float> widths, reaches;
    for (std::size_t i = 0; i < n; ++i) {
      widths.push_back(kWidth * static_cast<float>(1 + i % 7));
      reaches.push_back(static_cast<float>(1 + i % 3));
    }
    for (unsigned with = 0; with < 16; ++with) {
      SCOPED_TRACE(testing::Message() << n << " points, lists " << with);
      const bool marks = with & 1, others = with & 2;
      Sinking how{.width = kWidth, .reach = 2, .slope = 0.5F, .marked = 7};
      if (with & 4) how.widths = widths;
      if (with & 8) how.reaches = reaches;
      Values exact = values, found = values;
      sink_plainly(how, marks, others, exact);
      GetParam()->sink(found.distances, how, marks ? found.marks.data() : nullptr, others ? found.others.data() : nullptr,
                       found.caps.data());
      EXPECT_EQ(found.marks, exact.marks);
      EXPECT_EQ(found.others, exact.others);
      EXPECT_EQ(found.caps, exact.caps);
    }
  }
}

TEST_P(Tallies, WhatIsSavedIsThatOfAPlainLoop) {
  for (const std::size_t n : {0, 1, 3, 15, 16, 17, 5003}) {
    const Values v = make_values(n);
    double exact = 0;
    for (std::size_t i = 0; i < n; ++i) exact += v.distances[i] < v.caps[i] ? static_cast<double>(v.caps[i] - v.distances[i]) : 0.0;
    EXPECT_NEAR(GetParam()->saved(v.caps, v.distances), exact, 1e-12 * exact) << n;
  }
}

TEST_P(Tallies, BentDistancesAreThoseOfAPlainLoop) {
  const Bending how{.unit = 2 * kWidth, .bend = 0.8F, .farthest = 3, .beyond = 5};
  for (const std::size_t n : {0, 1, 3, 15, 16, 17, 5003}) {
    const Values v = make_values(n);
    std::vector<float> found = v.distances;
    GetParam()->bend(found, how);
    for (std::size_t i = 0; i < n; ++i) {
      const double d = static_cast<double>(v.distances[i]), unit = static_cast<double>(how.unit), bend = static_cast<double>(how.bend);
      if (std::isnan(d)) {
        EXPECT_TRUE(std::isnan(found[i]));
      } else {
        const double exact = d > 3 * unit ? 5 * unit : unit * std::log1p(d / (bend * unit)) / std::log1p(1 / bend);
        EXPECT_NEAR(static_cast<double>(found[i]), exact, 1e-6 * unit) << i << " of " << n << ", " << d;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OnEach, Tallies, testing::ValuesIn(cpu::available_tally_kernels()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace swarmfit::kernels
