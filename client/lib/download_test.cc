#include <gtest/gtest.h>

#include "client/lib/blob_transfer.h"
#include "client/lib/result_download.h"
#include "tests/support/service/breaking_server.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using DownloadTest = BreakingServerTest;

TEST_F(DownloadTest, ResumesAndLeavesNoOtherFiles) {
  blobs_.blobs[name_] = bytes_;
  blobs_.drops = 2;
  blobs_.limit = 700'000;
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_);
  EXPECT_EQ(std::distance(fs::directory_iterator(target_.parent_path()), {}), 1);
  blobs_.blobs.clear();
  EXPECT_NO_THROW(Download());  // it is there already
}

TEST_F(DownloadTest, RefusesOtherBytes) {
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

TEST_F(DownloadTest, DamagedBlobIsSetAsideAndReplaced) {
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

TEST_F(DownloadTest, WaitsWhileServerIsBusy) {
  blobs_.blobs[name_] = bytes_;
  blobs_.turned_away = 1;
  Download();
  EXPECT_EQ(ReadFile(target_), bytes_);
}

TEST_F(DownloadTest, DoesNotFollowSymbolicLinks) {
  blobs_.blobs[name_] = bytes_;
  const fs::path precious = scratch_.path() / "precious";
  WriteFileAtomic(precious, "mine");
  fs::create_directories(target_.parent_path());
  fs::create_symlink(
      precious, target_.parent_path() / (".color3d-" + digest_.sha256.substr(0, 16) + ".part"));
  fs::create_symlink(precious, target_);
  Download();
  EXPECT_EQ(ReadFile(precious), "mine");
  EXPECT_FALSE(fs::is_symlink(target_));
  EXPECT_EQ(ReadFile(target_), bytes_);
}

TEST_F(DownloadTest, RefusesMalformedDigest) {
  for (const std::string& digest :
       {std::string("../../../x"), std::string("/etc/"), std::string(), std::string(64, 'G')}) {
    try {
      DownloadBlob(*connection_, {digest, 5}, target_, [](int64_t) {});
      FAIL() << digest;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kDataLoss) << digest;
      EXPECT_NE(std::string(e.what()).find("malformed digest"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(DownloadBlob(*connection_, {digest_.sha256, -1}, target_, [](int64_t) {}), Error);
  EXPECT_FALSE(fs::exists(target_.parent_path()));
}

TEST_F(DownloadTest, LostServerNamesFilesAndNextStep) {
  blobs_.blobs[name_] = bytes_;
  Connection impatient(
      {.address = connection_->address(), .patience = std::chrono::milliseconds(100)}, cancel_);
  const FileDigest other{std::string(64, 'a'), 7};
  const fs::path out = scratch_.path() / "out";
  bool gone = false;
  try {
    DownloadBelow(
        impatient,
        {{"whole.bin", digest_}, {"lost.bin", other}},
        out,
        [&](int64_t received, int64_t) {
          if (received < digest_.size_bytes || gone) return;
          gone = true;
          server_->Shutdown(std::chrono::system_clock::now());
        },
        "fetch the rest with `color3d artifact download jobs/1`");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable);
    const std::string text = e.what();
    EXPECT_NE(text.find("1 of 2 files are complete in " + out.string()), std::string::npos) << text;
    EXPECT_NE(text.find("artifact download jobs/1"), std::string::npos) << text;
    EXPECT_EQ(text.find("start one"), std::string::npos) << text;
  }
  EXPECT_EQ(ReadFile(out / "whole.bin"), bytes_);
  EXPECT_FALSE(fs::exists(out / "lost.bin"));
}

TEST_F(DownloadTest, NamesAndLinksStayInFolder) {
  blobs_.blobs[name_] = bytes_;
  const fs::path out = scratch_.path() / "out", elsewhere = scratch_.path() / "elsewhere";
  fs::create_directory(out);
  fs::create_directory(elsewhere);
  fs::create_directory_symlink(elsewhere, out / "renders");
  for (const std::string name : {"../x.bin", "renders/x.bin"}) {
    EXPECT_THROW(DownloadBelow(
                     *connection_, {{name, digest_}}, out, [](int64_t, int64_t) {}, ""),
                 Error)
        << name;
  }
  EXPECT_TRUE(fs::is_empty(elsewhere));
  EXPECT_FALSE(fs::exists(scratch_.path() / "x.bin"));
}

TEST_F(DownloadTest, MissingBlobIsNotFound) {
  try {
    Download();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
  }
}

}  // namespace
}  // namespace color3d::client
