#include "server/access/tls.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/support/service/test_certificates.h"

namespace color3d {
namespace {

std::string Complaint(const TlsFiles& files) {
  try {
    MakeServerCredentials(files);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    return e.what();
  }
  return "";
}

TEST(TlsTest, NamesBadFiles) {
  ScratchFolder scratch;
  testing::TestAuthority authority(scratch.path(), "authority");
  const auto good = authority.Issue("good"), other = authority.Issue("other");
  const auto expired = authority.Issue("expired", -7200, -3600);
  const auto early = authority.Issue("early", 3600, 7200);
  const auto text = scratch.path() / "text";
  WriteFileAtomic(text, "no PEM");
  EXPECT_EQ(Complaint({good.certificate, good.key, {}}), "");
  EXPECT_EQ(Complaint({good.certificate, good.key, authority.certificate()}), "");
  const auto has = [](const std::string& complaint, const std::string& words) {
    return complaint.find(words) != std::string::npos;
  };
  EXPECT_TRUE(has(Complaint({good.certificate, {}, {}}), "--tls-key"));
  EXPECT_TRUE(has(Complaint({good.certificate, other.key, {}}), "not the key"));
  EXPECT_TRUE(has(Complaint({expired.certificate, expired.key, {}}), "has expired"));
  EXPECT_TRUE(has(Complaint({early.certificate, early.key, {}}), "not valid yet"));
  EXPECT_TRUE(has(Complaint({text, good.key, {}}), "no certificate"));
  EXPECT_TRUE(has(Complaint({good.certificate, text, {}}), "not an unencrypted private key"));
  EXPECT_TRUE(has(Complaint({good.certificate, good.key, text}), "no certificate"));
  EXPECT_TRUE(has(Complaint({scratch.path() / "none", good.key, {}}), "--tls-cert"));
}

}  // namespace
}  // namespace color3d
