#include "server/rpc/calls/call_memory.h"

#include <gtest/gtest.h>

#include <string>

#include "server/base/service_error.h"

namespace color3d::testing {
namespace {

TEST(CallMemoryTest, ClientAboveShareIsRefused) {
  CallMemory memory(100);
  memory.Add("one", 60);
  EXPECT_NO_THROW(memory.RequireShare("one"));
  memory.Add("other", 10);
  EXPECT_EQ(memory.held_bytes(), 70);
  EXPECT_THROW(memory.RequireShare("one"), ServiceError) << "holds 60 of 50";
  EXPECT_NO_THROW(memory.RequireShare("one", 20)) << "holds 40 of 50 without its own 20";
  EXPECT_NO_THROW(memory.RequireShare("other"));
  EXPECT_NO_THROW(memory.RequireShare("third client without memory"));
  memory.Add("other", -10);
  EXPECT_NO_THROW(memory.RequireShare("one")) << "the only client again";
  memory.Add("one", 40);
  try {
    memory.RequireShare("one");
    FAIL() << "holds 100 of 100";
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable) << "clients retry this code";
    EXPECT_EQ(e.reason(), ErrorReason::kOverloaded);
  }
  memory.Add("one", -100);
  EXPECT_NO_THROW(memory.RequireShare("one"));
  EXPECT_EQ(memory.held_bytes(), 0);
}

TEST(CallMemoryTest, SumOfSharesIsBounded) {
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
