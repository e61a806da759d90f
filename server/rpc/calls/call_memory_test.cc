#include "server/rpc/calls/call_memory.h"

#include <gtest/gtest.h>

#include <string>

#include "server/base/service_error.h"

namespace color3d::testing {
namespace {

TEST(CallMemory, WhoHoldsHisShareWaitsAndTheOthersGoOn) {
  CallMemory memory(100);
  memory.Add("one", 60);
  EXPECT_NO_THROW(memory.RequireShare("one"));
  memory.Add("other", 10);
  EXPECT_EQ(memory.held_bytes(), 70);
  EXPECT_THROW(memory.RequireShare("one"), ServiceError) << "60 of 50";
  EXPECT_NO_THROW(memory.RequireShare("one", 20)) << "40 of 50 without its own";
  EXPECT_NO_THROW(memory.RequireShare("other"));
  EXPECT_NO_THROW(memory.RequireShare("a third, who has nothing yet"));
  memory.Add("other", -10);
  EXPECT_NO_THROW(memory.RequireShare("one")) << "alone again";
  memory.Add("one", 40);
  try {
    memory.RequireShare("one");
    FAIL() << "100 of 100";
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable) << "clients try such calls again";
    EXPECT_EQ(e.reason(), ErrorReason::kOverloaded);
  }
  memory.Add("one", -100);
  EXPECT_NO_THROW(memory.RequireShare("one"));
  EXPECT_EQ(memory.held_bytes(), 0);
}

TEST(CallMemory, ClientsThatComeOneAfterTheOtherHoldABoundedSum) {
  CallMemory memory(1 << 20);
  for (int i = 0; i < 100; ++i) {
    const std::string client = std::to_string(i);
    for (;;) {
      try {
        memory.RequireShare(client);
      } catch (const Error&) {
        break;
      }
      memory.Add(client, 1 << 10);
    }
  }
  EXPECT_LT(memory.held_bytes(), 6 << 20);
}

}  // namespace
}  // namespace color3d::testing
