#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/blob_transfer.h"
#include "tests/support/service/breaking_server.h"

namespace color3d::client {
namespace {

using UploadTest = BreakingServerTest;

TEST_F(UploadTest, ResumesAfterBrokenConnection) {
  blobs_.drops = 2;
  blobs_.limit = 1'000'000;
  Upload(bytes_);
  EXPECT_EQ(blobs_.blobs[name_], bytes_);
  EXPECT_EQ(blobs_.writes, 3);
  EXPECT_EQ(blobs_.uploads.size(), 1u);
  EXPECT_EQ(last_done_, digest_.size_bytes);
  Upload(bytes_);  // the server has it: nothing is sent
  EXPECT_EQ(blobs_.writes, 3);
}

TEST_F(UploadTest, WaitsWhileServerIsBusy) {
  blobs_.turned_away = 2;
  Upload(bytes_);
  EXPECT_EQ(blobs_.blobs[name_], bytes_);
  EXPECT_EQ(blobs_.writes, 3);
}

TEST_F(UploadTest, UploadsEmptyFiles) {
  bytes_.clear();
  digest_ = {Sha256Hex(""), 0};
  name_ = "blobs/" + digest_.sha256 + "/0";
  Upload("");
  ASSERT_TRUE(blobs_.blobs.contains(name_));
  Download();
  EXPECT_EQ(ReadFile(target_), "");
}

TEST_F(UploadTest, NamesFileThatBecameShorter) {
  try {
    Upload(bytes_.substr(0, 1000));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("changed while it was read"));
  }
}

TEST_F(UploadTest, CancelEndsUpload) {
  cancel_.Cancel();
  EXPECT_THROW(Upload(bytes_), Error);
}

}  // namespace
}  // namespace color3d::client
