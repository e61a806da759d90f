#include "server/worker/live/byte_bound_cache.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

struct Loaded {
  int64_t bytes = 0;
};
using Cache = ByteBoundCache<Loaded>;
Loaded Sized(int64_t bytes) { return {bytes}; }

TEST(ByteBoundCacheTest, LoadsOnceAndEvictsLeastRecentlyUsed) {
  Cache cache(100);
  int loads = 0;
  const auto get = [&](const std::string& key) {
    cache.Get(key, [&] {
      ++loads;
      return Sized(40);
    });
  };
  get("a"), get("b"), get("a");
  EXPECT_EQ(loads, 2);
  get("c");  // b goes
  EXPECT_EQ(cache.bytes(), 80);
  get("a");
  EXPECT_EQ(loads, 3);
  get("b");
  EXPECT_EQ(loads, 4);
  EXPECT_EQ(cache.size(), 2u);
}

TEST(ByteBoundCacheTest, KeepsColorizersInUseBeyondBound) {
  Cache cache(100);
  const auto used = cache.Get("used", [] { return Sized(90); });
  const auto also = cache.Get("also", [] { return Sized(90); });
  cache.Get("idle", [] { return Sized(90); });
  cache.Get("next", [] { return Sized(1); });
  EXPECT_EQ(cache.bytes(), 181) << "the idle one goes, though the others are older";
  EXPECT_EQ(cache.Get("used", [] { return Sized(1); }), used);
  EXPECT_EQ(cache.Get("also", [] { return Sized(1); }), also);
}

TEST(ByteBoundCacheTest, FailedLoadIsNotCached) {
  Cache cache(100);
  EXPECT_THROW(cache.Get("a", []() -> Loaded { throw InvalidArgument("bad"); }), Error);
  EXPECT_EQ(cache.size(), 0u);
  EXPECT_EQ(cache.Get("a", [] { return Sized(7); })->bytes, 7);
}

}  // namespace
}  // namespace color3d
