#include "client/lib/names.h"

#include <gtest/gtest.h>

#include <set>

#include "core/base/error.h"

namespace color3d::client {
namespace {

TEST(Names, UuidsAreVersion4AndDiffer) {
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const std::string uuid = NewUuid();
    ASSERT_EQ(uuid.size(), 36u);
    for (const size_t dash : {8u, 13u, 18u, 23u}) EXPECT_EQ(uuid[dash], '-') << uuid;
    EXPECT_EQ(uuid[14], '4') << uuid;
    EXPECT_NE(std::string("89ab").find(uuid[19]), std::string::npos) << uuid;
    EXPECT_EQ(uuid.find_first_not_of("0123456789abcdef-"), std::string::npos) << uuid;
    seen.insert(uuid);
  }
  EXPECT_EQ(seen.size(), 100u);
}

TEST(Names, ResourcesMayBeShort) {
  EXPECT_EQ(ResourceName("3f", "jobs"), "jobs/3f");
  EXPECT_EQ(ResourceName("jobs/3f", "jobs"), "jobs/3f");
  EXPECT_THROW(ResourceName("scenes/3f", "jobs"), Error);
  EXPECT_THROW(ResourceName("", "jobs"), Error);
  EXPECT_THROW(ResourceName("jobs/", "jobs"), Error);
}

TEST(Names, ByteStreamResources) {
  const FileDigest digest{std::string(64, 'a'), 12};
  EXPECT_EQ(BlobResource(digest), "blobs/" + std::string(64, 'a') + "/12");
  EXPECT_EQ(UploadResource("u-1", digest), "uploads/u-1/blobs/" + std::string(64, 'a') + "/12");
}

TEST(Names, Utf8) {
  EXPECT_TRUE(IsUtf8(""));
  EXPECT_TRUE(IsUtf8("photo.jpg"));
  EXPECT_TRUE(IsUtf8("\xc3\xa9t\xc3\xa9.jpg"));
  EXPECT_TRUE(IsUtf8("\xe2\x82\xac"));
  EXPECT_TRUE(IsUtf8("\xf0\x9f\x93\xb7"));
  EXPECT_FALSE(IsUtf8("\xe9t\xe9.jpg"));     // Latin-1
  EXPECT_FALSE(IsUtf8("\xc0\xaf"));          // overlong
  EXPECT_FALSE(IsUtf8("\xe0\x80\xaf"));      // overlong
  EXPECT_FALSE(IsUtf8("\xed\xa0\x80"));      // surrogate
  EXPECT_FALSE(IsUtf8("\xf4\x90\x80\x80"));  // beyond U+10FFFF
  EXPECT_FALSE(IsUtf8("\xe2\x82"));          // cut short
}

}  // namespace
}  // namespace color3d::client
