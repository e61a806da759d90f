#include <gtest/gtest.h>

#include "client/lib/blob_transfer.h"
#include "tests/support/service/breaking_server.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using DownloadTest = BreakingServerTest;

TEST_F(DownloadTest, DownloadResumesAndLeavesNothingElseBehind) {
  blobs_.blobs[name_] = bytes_;
  blobs_.drops = 2;
  blobs_.limit = 700'000;
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_);
  EXPECT_EQ(std::distance(fs::directory_iterator(target_.parent_path()), {}), 1);
  blobs_.blobs.clear();
  EXPECT_NO_THROW(Download());  // it is there already
}

TEST_F(DownloadTest, DownloadRefusesOtherBytes) {
  blobs_.blobs[name_] = bytes_;
  blobs_.corrupt = true;
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
  }
  EXPECT_FALSE(fs::exists(target_));
}

TEST_F(DownloadTest, TheServerIsLedToSeeWhatIsDamaged) {
  blobs_.blobs[name_] = bytes_;
  blobs_.corrupt = true;
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
    EXPECT_STREQ(e.what(), "damaged and set aside");
  }
  EXPECT_TRUE(blobs_.blobs.empty());
  EXPECT_TRUE(fs::is_empty(target_.parent_path()));
  blobs_.corrupt = false;
  Upload(bytes_);
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_) << "healed";
}

TEST_F(DownloadTest, DownloadWaitsWhileTheServerIsFull) {
  blobs_.blobs[name_] = bytes_;
  blobs_.turned_away = 1;
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_);
}

TEST_F(DownloadTest, DownloadOfAMissingBlobIsNotFound) {
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
  }
}

}  // namespace
}  // namespace color3d::client
