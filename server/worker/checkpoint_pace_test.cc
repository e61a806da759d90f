#include "server/worker/checkpoint_pace.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Checkpoints are saved as soon as possible; each takes longer than the one before.
TEST(CheckpointPace, LargeCheckpointsTakeTwentiethOfTime) {
  const CheckpointPace::Time begin{};
  CheckpointPace::Time now = begin;
  CheckpointPace pace(seconds(20), now);
  milliseconds saving{0};
  int saved = 0;
  while (now < begin + seconds(4000)) {
    now += milliseconds(500);
    if (!pace.IsDue(now)) continue;
    const milliseconds took(200 * saved++);
    now += took;
    saving += took;
    pace.OnSaved(now);
  }
  EXPECT_GT(saved, 20);
  EXPECT_LT(20 * saving, now - begin);
}

TEST(CheckpointPace, CheapCheckpointsKeepInterval) {
  const CheckpointPace::Time begin{};
  CheckpointPace pace(seconds(20), begin);
  EXPECT_FALSE(pace.IsDue(begin + seconds(19)));
  EXPECT_TRUE(pace.IsDue(begin + seconds(20)));
  pace.OnSaved(begin + milliseconds(20'100));
  EXPECT_FALSE(pace.IsDue(begin + seconds(40)));
  EXPECT_TRUE(pace.IsDue(begin + milliseconds(40'100)));
  pace.OnSaved(begin + seconds(43));  // it took 2.9 s
  EXPECT_FALSE(pace.IsDue(begin + seconds(43 + 57)));
  EXPECT_TRUE(pace.IsDue(begin + seconds(43 + 59)));
}

TEST(CheckpointPace, SavesEachWithoutInterval) {
  const CheckpointPace::Time begin{};
  CheckpointPace pace(milliseconds(0), begin);
  EXPECT_TRUE(pace.IsDue(begin));
  pace.OnSaved(begin + seconds(5));
  EXPECT_TRUE(pace.IsDue(begin + seconds(5)));
}

}  // namespace
}  // namespace color3d
