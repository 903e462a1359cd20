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

TEST_P(Tallies, WhatAFoundModelLeavesIsThatOfAPlainLoop) {
  const Sinking how{7 * kWidth, 2 * kWidth, 0.5F};
  for (const std::size_t n : {0, 1, 15, 16, 17, 5003}) {
    for (const bool with_others : {false, true}) {
      SCOPED_TRACE(n);
      Values exact = make_values(n), found = exact;
      for (std::size_t i = 0; i < n; ++i) {
        const float d = exact.distances[i], left = how.slope * (d - how.level);
        if (d < how.reach) exact.marks[i] = 1;
        if (with_others && d < exact.others[i]) exact.others[i] = d;
        if (left < exact.caps[i]) exact.caps[i] = std::max(left, 0.0F);
      }
      GetParam()->sink(found.distances, how, found.marks.data(), with_others ? found.others.data() : nullptr, found.caps.data());
      EXPECT_EQ(found.marks, exact.marks);
      EXPECT_EQ(found.others, exact.others);
      EXPECT_EQ(found.caps, exact.caps);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OnEach, Tallies, testing::ValuesIn(cpu::available_tally_kernels()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace swarmfit::kernels
