#include "server/rpc/live/poison_watch.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {
using End = PoisonWatch::End;

TEST(PoisonWatch, OneThatKillsIsFoundAndTakesNoOtherWithIt) {
  PoisonWatch watch;
  for (const char* picture : {"good", "bad", "other"}) {
    ASSERT_TRUE(watch.MaySend(picture));
    watch.OnSent(picture);
  }
  watch.OnEnd("other", End::kAnswered);  // answered before it happened
  watch.OnEnd("good", End::kWorkerDied);
  watch.OnEnd("bad", End::kWorkerDied);
  EXPECT_FALSE(watch.IsPoison("good"));
  EXPECT_FALSE(watch.IsSuspect("other"));
  // They come again.
  watch.OnSent("other");
  EXPECT_FALSE(watch.MaySend("good")) << "another one is with the worker";
  watch.OnEnd("other", End::kAnswered);
  ASSERT_TRUE(watch.MaySend("good"));
  watch.OnSent("good");
  EXPECT_FALSE(watch.MaySend("bad"));
  EXPECT_FALSE(watch.MaySend("other")) << "nobody joins a suspect";
  watch.OnEnd("good", End::kAnswered);
  EXPECT_FALSE(watch.IsSuspect("good"));
  ASSERT_TRUE(watch.MaySend("bad"));
  watch.OnSent("bad");
  watch.OnEnd("bad", End::kWorkerDied);
  EXPECT_TRUE(watch.IsPoison("bad"));
  EXPECT_TRUE(watch.MaySend("good"));
}

TEST(PoisonWatch, RemembersSoManyAndNoMore) {
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
