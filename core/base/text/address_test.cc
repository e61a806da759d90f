#include "core/base/text/address.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

std::string Refusal(const std::string& address) {
  try {
    CheckAddressForm("--server", address);
    return "";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
}

TEST(CheckAddressForm, AcceptsAddressWithoutScheme) {
  EXPECT_EQ(Refusal("http://127.0.0.1:50551"),
            "--server http://127.0.0.1:50551: http:// is not needed; say --server 127.0.0.1:50551");
  EXPECT_EQ(Refusal("http://box:50551/x/"),
            "--server http://box:50551/x/: http:// is not needed; say --server box:50551");
  EXPECT_NE(Refusal("grpc://box:1").find("grpc:// is not needed"), std::string::npos);
  EXPECT_EQ(Refusal("127.0.0.1:50551"), "");
  EXPECT_EQ(Refusal("[::1]:50551"), "");
}

TEST(CheckAddressForm, LimitsUnixSocketPath) {
  EXPECT_EQ(Refusal("unix:/tmp/a.sock"), "");
  EXPECT_EQ(Refusal("unix:///tmp/a.sock"), "");
  EXPECT_EQ(Refusal("unix:" + std::string(107, 'a')), "");
  const std::string refusal = Refusal("unix:" + std::string(108, 'a'));
  EXPECT_NE(refusal.find("has 108 bytes, a Unix socket's may have 107"), std::string::npos)
      << refusal;
  EXPECT_NE(Refusal("unix:").find("the path is missing"), std::string::npos);
}

}  // namespace
}  // namespace color3d
