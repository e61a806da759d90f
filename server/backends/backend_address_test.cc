#include "server/backends/backend_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Complaint(const std::string& address) {
  try {
    ParseBackendAddress("b", address);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(BackendAddressTest, ParsesSchemes) {
  EXPECT_EQ(ParseBackendAddress("b", "127.0.0.1:7").target, "127.0.0.1:7");
  EXPECT_FALSE(ParseBackendAddress("b", "unix:/run/x").tls);
  EXPECT_THAT(Complaint("unix:/" + std::string(107, 'x')), HasSubstr("108 bytes"));
  EXPECT_TRUE(ParseBackendAddress("b", "https://gpu.example:443").tls);
  EXPECT_EQ(ParseBackendAddress("b", "https://gpu.example:443").target, "gpu.example:443");
  EXPECT_FALSE(ParseBackendAddress("b", "http://gpu.example:80").tls);
  EXPECT_EQ(ParseBackendAddress("b", "http://[2001:db8::1]:80").target, "[2001:db8::1]:80");
}

TEST(BackendAddressTest, OtherMachinesNeedScheme) {
  EXPECT_THAT(Complaint("gpu.example:443"),
              AllOf(HasSubstr("--backend b="), HasSubstr("https://gpu.example:443")));
}

TEST(BackendAddressTest, RejectsBadAddresses) {
  for (const char* bad : {"",
                          "localhost",
                          "localhost:",
                          "localhost:x",
                          "localhost:99999",
                          "ftp://localhost:1",
                          ":5",
                          "https://",
                          "localhost:0"}) {
    EXPECT_THAT(Complaint(bad), HasSubstr("--backend b=")) << bad;
  }
}

}  // namespace
}  // namespace color3d
