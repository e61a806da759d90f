#include "server/rpc/live/poison_watch.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {
using End = PoisonWatch::End;

TEST(PoisonWatchTest, IdentifiesPictureThatKillsWorker) {
  PoisonWatch watch;
  for (const char* picture : {"good", "bad", "other"}) {
    ASSERT_TRUE(watch.MaySend(picture));
    watch.OnSent(picture);
  }
  watch.OnEnd("other", End::kAnswered);  // answered before the worker died
  watch.OnEnd("good", End::kWorkerDied);
  watch.OnEnd("bad", End::kWorkerDied);
  EXPECT_FALSE(watch.IsPoison("good"));
  EXPECT_FALSE(watch.IsSuspect("other"));
  // Both are sent again.
  watch.OnSent("other");
  EXPECT_FALSE(watch.MaySend("good")) << "another picture is with the worker";
  watch.OnEnd("other", End::kAnswered);
  ASSERT_TRUE(watch.MaySend("good"));
  watch.OnSent("good");
  EXPECT_FALSE(watch.MaySend("bad"));
  EXPECT_FALSE(watch.MaySend("other")) << "a suspect must be alone";
  watch.OnEnd("good", End::kAnswered);
  EXPECT_FALSE(watch.IsSuspect("good"));
  ASSERT_TRUE(watch.MaySend("bad"));
  watch.OnSent("bad");
  watch.OnEnd("bad", End::kWorkerDied);
  EXPECT_TRUE(watch.IsPoison("bad"));
  EXPECT_TRUE(watch.MaySend("good"));
}

TEST(PoisonWatchTest, BoundsRememberedPictures) {
  PoisonWatch watch;
  for (int i = 0; i < 20'001; ++i) {
    watch.OnSent(std::to_string(i));
    watch.OnEnd(std::to_string(i), End::kWorkerDied);
  }
  EXPECT_FALSE(watch.IsSuspect("0"));
  EXPECT_TRUE(watch.IsSuspect("20000"));
}

}  // namespace
}  // namespace color3d
