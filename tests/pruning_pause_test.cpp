// When a swarm's blocks are looked at, by what looking at earlier swarms' saved.
#include <gtest/gtest.h>

#include "kernels/pruning_pause.hpp"

namespace swarmfit::kernels {
namespace {

constexpr double kPoor = 0.7;

/// Swarms that pass until the blocks are looked at again.
int passing(PruningPause& pause) {
  int swarms = 0;
  while (!pause.now()) ++swarms;
  return swarms;
}

TEST(PruningPause, EachTimeInVainItIsLonger) {
  PruningPause pause;
  EXPECT_EQ(passing(pause), 0);
  for (const int swarms : {4, 8, 16, 32, 32}) {
    pause.note(0.9, kPoor);
    EXPECT_FALSE(pause.proven());
    EXPECT_EQ(passing(pause), swarms);
  }
  pause.note(kPoor, kPoor);
  EXPECT_TRUE(pause.proven());
  EXPECT_EQ(passing(pause), 0);
  pause.note(0.9, kPoor);
  EXPECT_EQ(passing(pause), 4);
}

TEST(PruningPause, NewCapsSayNothingOfWhatOldOnesDid) {
  PruningPause pause;
  pause.note(0.2, kPoor);
  pause.forget();
  EXPECT_FALSE(pause.proven());
  EXPECT_TRUE(pause.now());
  pause.note(0.9, kPoor);
  pause.forget();
  EXPECT_EQ(passing(pause), 0);
}

}  // namespace
}  // namespace swarmfit::kernels
