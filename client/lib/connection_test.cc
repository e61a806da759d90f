#include "client/lib/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "core/base/error.h"

namespace color3d::client {
namespace {

TEST(Connection, SaysHowToStartAServer) {
  const CancellationToken cancel;
  const auto begun = std::chrono::steady_clock::now();
  try {
    const Connection nobody({.address = "127.0.0.1:1"}, cancel);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("cannot reach a server at 127.0.0.1:1"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("color3d-server serve"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
}

TEST(Connection, MalformedAddressNamesRemedy) {
  const CancellationToken cancel;
  const auto refusal = [&](const std::string& address) -> std::string {
    try {
      const Connection nobody({.address = address}, cancel);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument) << address;
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("http://127.0.0.1:50551"),
              ::testing::HasSubstr("http:// is not needed; say --server 127.0.0.1:50551"));
  EXPECT_THAT(refusal("unix:/" + std::string(200, 'a')), ::testing::HasSubstr("201 bytes"));
}

TEST(Connection, SendsNoTokenUnencryptedToOtherMachine) {
  const CancellationToken cancel;
  for (const char* elsewhere :
       {"10.1.2.3:1", "127.0.0.1.example.org:1", "localhost.example.org:1", "[::2]:1"}) {
    try {
      const Connection nobody({.address = elsewhere, .token = "secret"}, cancel);
      FAIL() << elsewhere;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument) << elsewhere;
      EXPECT_THAT(e.what(), ::testing::HasSubstr("https://"));
    }
  }
}

}  // namespace
}  // namespace color3d::client
