#include "client/studio/studio_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "client/studio/http_library.h"

namespace color3d::client {
namespace {
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

httplib::Request RequestWith(const std::vector<std::pair<std::string, std::string>>& headers,
                             const std::string& method = "GET") {
  httplib::Request request;
  request.method = method;
  for (const auto& [name, value] : headers) request.headers.emplace(name, value);
  return request;
}

TEST(StudioGuardTest, SecretsDiffer) {
  std::set<std::string> secrets;
  for (int i = 0; i < 100; ++i) secrets.insert(NewSecret());
  EXPECT_EQ(secrets.size(), 100u);
  EXPECT_THAT(*secrets.begin(), MatchesRegex("[0-9a-f]{64}"));
  EXPECT_TRUE(AreEqualSecrets("abc", "abc"));
  EXPECT_FALSE(AreEqualSecrets("abc", "abd"));
  EXPECT_FALSE(AreEqualSecrets("abc", "abcd"));
}

TEST(StudioGuardTest, TokenOpensOnce) {
  StudioGuard guard(4711);
  EXPECT_EQ(guard.Exchange(""), "");
  EXPECT_EQ(guard.Exchange(std::string(64, '0')), "");
  const std::string cookie = guard.Exchange(guard.token());
  EXPECT_THAT(cookie, HasSubstr("; HttpOnly; SameSite=Strict"));
  EXPECT_THAT(cookie, testing::Not(HasSubstr(guard.token())));
  EXPECT_EQ(guard.Exchange(guard.token()), "");
  const std::string pair = cookie.substr(0, cookie.find(';'));
  EXPECT_EQ(guard.CheckCookie(RequestWith({{"Cookie", pair}})).status, 200);
  EXPECT_EQ(guard.CheckCookie(RequestWith({{"Cookie", "a=b; " + pair + "; c=d"}})).status, 200);
  EXPECT_EQ(guard.CheckCookie(RequestWith({})).status, 403);
  EXPECT_EQ(guard.CheckCookie(RequestWith({{"Cookie", pair + "0"}})).status, 403);
  EXPECT_EQ(guard.CheckCookie(RequestWith({{"Cookie", "x" + pair}})).status, 403);
  EXPECT_EQ(guard.CheckCookie(RequestWith({{"Cookie", pair + "; " + pair}})).status, 403);
  StudioGuard other(4711);
  EXPECT_EQ(other.CheckCookie(RequestWith({{"Cookie", pair}})).status, 403);
}

TEST(StudioGuardTest, RefusesOtherHostsAndPages) {
  const StudioGuard guard(4711);
  const auto status = [&](const std::vector<std::pair<std::string, std::string>>& headers,
                          const std::string& method = "GET") {
    return guard.CheckOrigin(RequestWith(headers, method)).status;
  };
  const std::pair<std::string, std::string> host{"Host", "127.0.0.1:4711"};
  EXPECT_EQ(status({host}), 200);
  EXPECT_EQ(status({{"Host", "localhost:4711"}}), 200);
  EXPECT_EQ(status({}), 421);
  for (const char* other : {"127.0.0.1",
                            "127.0.0.1:4712",
                            "evil.example:4711",
                            "127.0.0.1.evil.example:4711",
                            "127.0.0.1:4711.evil.example"}) {
    EXPECT_EQ(status({{"Host", other}}), 421) << other;
  }
  EXPECT_EQ(status({host, {"Host", "evil.example"}}), 421);
  EXPECT_EQ(status({host, {"Origin", "http://127.0.0.1:4711"}}, "POST"), 200);
  EXPECT_EQ(status({host}, "POST"), 403);
  for (const char* other : {"null",
                            "http://evil.example",
                            "https://127.0.0.1:4711",
                            "http://localhost:4711",
                            "http://127.0.0.1:4712"}) {
    EXPECT_EQ(status({host, {"Origin", other}}), 403) << other;
    EXPECT_EQ(status({host, {"Origin", other}}, "POST"), 403) << other;
  }
}

}  // namespace
}  // namespace color3d::client
