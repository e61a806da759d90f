#include "client/studio/queue/queue_calls.h"

#include <gmock/gmock.h>

namespace color3d::client {
namespace {

using testing::ElementsAre;

TEST(OrderOfWaitingTest, TakesTheWantedOrder) {
  EXPECT_THAT(OrderOfWaiting({"c", "a", "b"}, {"a", "b", "c"}), ElementsAre("c", "a", "b"));
}

TEST(OrderOfWaitingTest, LeavesOutRunsThatHaveBegunAndRepeatedOnes) {
  EXPECT_THAT(OrderOfWaiting({"c", "a", "c", "b"}, {"b", "c"}), ElementsAre("c", "b"));
}

TEST(OrderOfWaitingTest, RunsThatAreNotNamedComeLast) {
  EXPECT_THAT(OrderOfWaiting({"c"}, {"a", "b", "c"}), ElementsAre("c", "a", "b"));
}

}  // namespace
}  // namespace color3d::client
