#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/text/address.h"
#include "server/access/tls.h"
#include "server/net/port_probe.h"
#include "tests/support/service/rpc_fixture.h"
#include "tests/support/service/test_certificates.h"

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

// The server's look at itself finds what clients would find, whatever it listens with.
TEST_F(RpcServerTest, ALookAtItsPortFindsWhetherItAnswers) {
  constexpr std::chrono::milliseconds kLimit(10'000);
  EXPECT_EQ(ProbePort({server_->address(), false}, kLimit), "");
  EXPECT_NE(ProbePort({server_->address(), true}, kLimit), "") << "it speaks no TLS";
  TestAuthority ours(scratch_.path(), "ours");
  const CertificateFiles own = ours.Issue("server");
  for (const bool wants_certificate : {false, true}) {
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.credentials =
        MakeServerCredentials({own.certificate,
                               own.key,
                               wants_certificate ? ours.certificate() : std::filesystem::path()});
    RpcServer tls(options, store_, blobs_, uploads_, SystemClock());
    EXPECT_EQ(ProbePort({tls.address(), true}, kLimit), "") << wants_certificate;
    EXPECT_NE(ProbePort({tls.address(), false}, kLimit), "") << "in the clear";
  }
  RpcServerOptions options;
  options.listen = "unix:" + (scratch_.path() / "s").string();
  auto local = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
  EXPECT_EQ(ProbePort({options.listen, false}, kLimit), "");
  local.reset();
  EXPECT_NE(ProbePort({options.listen, false}, kLimit), "");
  // Somebody listens and never answers, as a server that has run out of descriptors.
  const ListenSockets deaf("127.0.0.1:0");
  EXPECT_NE(ProbePort({deaf.address(), false}, std::chrono::milliseconds(300)), "");
  EXPECT_NE(ProbePort({deaf.address(), true}, std::chrono::milliseconds(300)), "");
}

}  // namespace
}  // namespace color3d::testing
