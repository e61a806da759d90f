#include "server/rpc/calls/stream_limit.h"

#include <gtest/gtest.h>

#include <vector>

namespace color3d {
namespace {

// As many as the project may have beside what is open.
std::vector<StreamLimit::Place> TakeAll(StreamLimit& limit, const std::string& project) {
  std::vector<StreamLimit::Place> places;
  try {
    while (places.size() < 1000) places.push_back(limit.Take(project));
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.reason(), ErrorReason::kQuotaExceeded);
  }
  return places;
}

TEST(StreamLimitTest, WhoeverTakesAllThatHeMayLeavesRoomForTheNext) {
  StreamLimit limit("uploads", 128, 0, /*shared=*/true);
  std::vector<StreamLimit::Place> first = TakeAll(limit, "a");
  EXPECT_EQ(first.size(), 64u) << "half of all";
  std::vector<StreamLimit::Place> second = TakeAll(limit, "b");
  EXPECT_EQ(second.size(), 32u);
  EXPECT_GT(TakeAll(limit, "c").size(), 0u);
  first.clear();
  EXPECT_GT(TakeAll(limit, "b").size(), 10u) << "what is free again is shared anew";
}

TEST(StreamLimitTest, WithoutProjectsOneMayHaveAll) {
  StreamLimit limit("uploads", 8, 0);
  std::vector<StreamLimit::Place> places;
  for (int i = 0; i < 8; ++i) places.push_back(limit.Take(""));
  try {
    limit.Take("");
    FAIL();
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.reason(), ErrorReason::kTooManyStreams);
  }
}

}  // namespace
}  // namespace color3d
