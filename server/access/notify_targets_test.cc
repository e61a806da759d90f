#include "server/access/notify_targets.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

bool IsAllowed(const std::string& url) {
  try {
    CheckNotifyUrl(url, {"https://hooks.example.org", "http://127.0.0.1:8080/done"});
    return true;
  } catch (const Error&) {
    return false;
  }
}

TEST(NotifyTargetsTest, AllowsOnlyConfiguredTargets) {
  EXPECT_TRUE(IsAllowed("https://hooks.example.org"));
  EXPECT_TRUE(IsAllowed("https://hooks.example.org/a/b?c=d"));
  EXPECT_TRUE(IsAllowed("https://hooks.example.org?c=d"));
  EXPECT_TRUE(IsAllowed("http://127.0.0.1:8080/done/42"));
  for (const char* url : {"http://hooks.example.org/",
                          "https://hooks.example.org.evil.net/",
                          "https://hooks.example.org@evil.net/",
                          "https://hooks.example.org:8443/",
                          "https://hooks.example.orgs/",
                          "http://127.0.0.1:8080/donefor",
                          "http://127.0.0.1:8080/done/../admin",
                          "http://127.0.0.1:8080/done/%2E%2e/admin",
                          "http://127.0.0.1:8080/done\\..\\admin",
                          "file:///etc/passwd",
                          "https://",
                          "https://hooks.example.org/a b",
                          "https://hooks.example.org/\r\nHost: evil",
                          ""}) {
    EXPECT_FALSE(IsAllowed(url)) << url;
  }
  EXPECT_FALSE(IsAllowed("https://hooks.example.org/" + std::string(1000, 'a')));
}

TEST(NotifyTargetsTest, RejectsBadTargets) {
  EXPECT_NO_THROW(CheckNotifyTarget("https://[::1]:8443/hooks"));
  for (const char* target : {"", "*", "https://", "hooks.example.org", "https://a@b"}) {
    EXPECT_THROW(CheckNotifyTarget(target), Error) << target;
  }
}

}  // namespace
}  // namespace color3d
