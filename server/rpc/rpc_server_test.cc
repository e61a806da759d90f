#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/address.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ::testing::HasSubstr;
using RpcServerTest = RpcTest;

TEST_F(RpcServerTest, BusyAddressIsExplained) {
  RpcServerOptions options;
  options.listen = server_->address();
  try {
    RpcServer second(options, store_, blobs_, uploads_, SystemClock());
    FAIL() << "two servers on one port";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("in use"));
    EXPECT_THAT(e.what(), HasSubstr("--listen"));
  }
  EXPECT_TRUE(IsLoopback("127.0.0.1:1"));
  EXPECT_TRUE(IsLoopback("[::1]:1"));
  EXPECT_TRUE(IsLoopback("unix:color3d.sock"));
  EXPECT_TRUE(IsLoopback("127.8.0.9:1"));
  EXPECT_TRUE(IsLoopback("localhost:1"));
  EXPECT_FALSE(IsLoopback("0.0.0.0:1"));
  EXPECT_FALSE(IsLoopback("127.0.0.1.example.org:1"));
  EXPECT_FALSE(IsLoopback("127.1:1")) << "no address; names that begin so may be anybody's";
  EXPECT_THROW(IsLoopback("nonsense"), Error);
}

}  // namespace
}  // namespace color3d::testing
