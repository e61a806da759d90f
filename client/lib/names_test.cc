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

TEST(Names, AcceptsShortResourceNames) {
  EXPECT_EQ(ResourceName("3f", "jobs"), "jobs/3f");
  EXPECT_EQ(ResourceName("jobs/3f", "jobs"), "jobs/3f");
  EXPECT_THROW(ResourceName("scenes/3f", "jobs"), Error);
  EXPECT_THROW(ResourceName("", "jobs"), Error);
  EXPECT_THROW(ResourceName("jobs/", "jobs"), Error);
}

TEST(Names, FormatsByteStreamResources) {
  const FileDigest digest{std::string(64, 'a'), 12};
  EXPECT_EQ(BlobResource(digest), "blobs/" + std::string(64, 'a') + "/12");
  EXPECT_EQ(UploadResource("u-1", digest), "uploads/u-1/blobs/" + std::string(64, 'a') + "/12");
}

}  // namespace
}  // namespace color3d::client
