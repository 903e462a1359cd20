// Two fits that must end alike: on other threads, in a batch, prepared or not.
#pragma once

#include <gtest/gtest.h>

#include <swarmfit/fit.hpp>

namespace swarmfit::tests {

/// Labels, models and what it took to find them, to the bit.
inline void expect_same_answer(const FitResult& one, const FitResult& other) {
  EXPECT_EQ(one.labels, other.labels);
  EXPECT_EQ(one.stop_reason, other.stop_reason);
  EXPECT_EQ(one.evaluations, other.evaluations);
  ASSERT_EQ(one.models.size(), other.models.size());
  for (std::size_t m = 0; m < one.models.size(); ++m) {
    EXPECT_EQ(one.models[m].type, other.models[m].type);
    EXPECT_EQ(one.models[m].parameters, other.models[m].parameters);
    EXPECT_EQ(one.models[m].covariance, other.models[m].covariance);
    EXPECT_EQ(one.models[m].cost, other.models[m].cost);
    EXPECT_EQ(one.models[m].evaluations, other.models[m].evaluations);
  }
}

}  // namespace swarmfit::tests
