// What is special about blobs in an object store; any_blob_store_test.cc has what all stores do.
#include "server/storage/s3/s3_blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "server/storage/collector.h"
#include "tests/support/service/s3_process.h"
#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::S3Process;

class S3BlobStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    server_ = std::make_unique<S3Process>(scratch_.path());
    options_.s3 = server_->Options();
    options_.folder = scratch_.path() / "cache";
    options_.reserve_bytes = 0;
    Open();
  }
  void Open() {
    blobs_.reset();
    blobs_ = std::make_unique<S3BlobStore>(options_);
  }
  static std::string KeyOfBlob(const std::string& folder, const std::string& sha256) {
    return folder + "/" + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256;
  }
  int Requests(const std::string& begin = "") {
    const auto requests = server_->Requests();
    return static_cast<int>(std::ranges::count_if(
        requests, [&](const std::string& request) { return request.starts_with(begin); }));
  }
  std::string Read(const FileDigest& digest) {
    std::string bytes;
    blobs_->Borrow(digest.sha256, [&](const fs::path& file) { bytes = ReadFile(file); });
    return bytes;
  }
  bool Has(const std::string& key) {
    const auto keys = server_->Keys();
    return std::ranges::find(keys, key) != keys.end();
  }

  ScratchFolder scratch_;
  std::unique_ptr<S3Process> server_;
  S3BlobOptions options_;
  std::unique_ptr<S3BlobStore> blobs_;
};

TEST_F(S3BlobStoreTest, ReadsOnceAndKeepsWhatFits) {
  options_.cache_bytes = 2'500;
  Open();
  std::vector<FileDigest> digests;
  for (int i = 0; i < 4; ++i) digests.push_back(blobs_->PutBytes(std::string(1000, 'a' + i)));
  server_->Requests();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Read(digests[0]), std::string(1000, 'a'));
  EXPECT_EQ(Requests("GET blobs/"), 1);
  for (const FileDigest& digest : digests) Read(digest);
  EXPECT_LE(blobs_->cached_bytes(), 2'500);
  server_->Requests();
  Open();  // the next server verifies what it finds
  EXPECT_EQ(Read(digests[3]), std::string(1000, 'd'));
  EXPECT_EQ(Requests(), 0);
  EXPECT_EQ(Read(digests[0]), std::string(1000, 'a'));
  EXPECT_EQ(Requests("GET blobs/"), 1);
}

TEST_F(S3BlobStoreTest, StoredFileIsInTheCache) {
  const fs::path file = scratch_.path() / "file";
  WriteFileAtomic(file, "content");
  const FileDigest digest = blobs_->PutFile(file);
  server_->Requests();
  EXPECT_EQ(Read(digest), "content");
  EXPECT_EQ(Requests(), 0);
  fs::remove_all(options_.folder);  // "may be deleted"
  fs::create_directories(options_.folder);
  EXPECT_EQ(Read(digest), "content");
}

TEST_F(S3BlobStoreTest, WholeBlobIsVerified) {
  const FileDigest digest = blobs_->PutBytes("some bytes");
  server_->Fail("GET blobs/", 1, R"("kind": "other_bytes")");
  EXPECT_EQ(Read(digest), "some bytes") << "read again";
  fs::remove(options_.folder / digest.sha256);
  server_->Fail("GET blobs/", 100, R"("kind": "other_bytes")");
  EXPECT_EQ(ReasonThrown([&] { Read(digest); }), "BLOB_DAMAGED");
  EXPECT_FALSE(fs::exists(options_.folder / digest.sha256));
}

TEST_F(S3BlobStoreTest, FillGoesOnAfterBreaksAndFailures) {
  const std::string bytes(100'000, 'y');
  const FileDigest digest = blobs_->PutBytes(bytes);
  server_->Fail("GET blobs/", 3, R"("kind": "truncate")");
  EXPECT_EQ(Read(digest), bytes);
  fs::remove(options_.folder / digest.sha256);
  server_->Fail("", 1000, R"("kind": "status", "status": 503, "code": "SlowDown")");
  EXPECT_EQ(ReasonThrown([&] { Read(digest); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_->Look(digest.sha256); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_->IsIntact(digest); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_->PutBytes("new"); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_->ForEach([](const StoredBlob&) { return true; }); }),
            "UNAVAILABLE");
  server_->EndFaults();
  EXPECT_EQ(Read(digest), bytes);
  EXPECT_FALSE(blobs_->Look(Sha256Hex("new")).has_value());
}

TEST_F(S3BlobStoreTest, FullStoreIsStorageFull) {
  server_->Fail(
      "PUT blobs/", 100, R"("kind": "status", "status": 507, "code": "XMinioStorageFull")");
  EXPECT_EQ(ReasonThrown([&] { blobs_->PutBytes("x"); }), "STORAGE_FULL");
  server_->Fail("PUT blobs/", 100, R"("kind": "status", "status": 403, "code": "QuotaExceeded")");
  EXPECT_EQ(ReasonThrown([&] { blobs_->PutBytes("x"); }), "STORAGE_FULL");
}

TEST_F(S3BlobStoreTest, FullDiskRefusesToFill) {
  const FileDigest digest = blobs_->PutBytes("x");
  options_.reserve_bytes = int64_t{1} << 60;
  Open();
  EXPECT_EQ(ReasonThrown([&] { Read(digest); }), "STORAGE_FULL");
  EXPECT_EQ(ReasonThrown([&] { blobs_->RequireSpace(0); }), "STORAGE_FULL");
}

TEST_F(S3BlobStoreTest, TouchedAgainSoonCostsNoRequest) {
  const FileDigest digest = blobs_->PutBytes("x");
  server_->Requests();
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(blobs_->Touch(digest));
  EXPECT_EQ(Requests(), 0);
  options_.touch_memory = std::chrono::milliseconds(0);
  Open();
  EXPECT_TRUE(blobs_->Touch(digest));
  EXPECT_TRUE(blobs_->Touch(digest));
  EXPECT_EQ(Requests("PUT touched/"), 2);
}

// Another server has set the blob aside since this one touched it.
TEST_F(S3BlobStoreTest, StoresAgainWhatOthersHaveRemoved) {
  const FileDigest digest = blobs_->PutBytes("x");
  server_->Set(R"({"remove": [")" + KeyOfBlob("blobs", digest.sha256) + R"("]})");
  blobs_->PutBytes("x");
  EXPECT_TRUE(Has(KeyOfBlob("blobs", digest.sha256)));
  server_->Set(R"({"remove": [")" + KeyOfBlob("blobs", digest.sha256) + R"("]})");
  EXPECT_EQ(ReasonThrown([&] { Read(digest); }), "BLOB_MISSING");
  EXPECT_FALSE(blobs_->Touch(digest)) << "and asks again";
}

TEST_F(S3BlobStoreTest, OldMarksOfOthersDoNotProtect) {
  const FileDigest digest = blobs_->PutBytes("x");
  Open();  // another process, as it seems
  const StoredBlob seen = *blobs_->Look(digest.sha256);
  EXPECT_FALSE(blobs_->RemoveIfUntouched(seen)) << "touched within an hour";
  server_->Set(R"({"age": [3700]})");
  EXPECT_TRUE(blobs_->RemoveIfUntouched(seen));
  EXPECT_TRUE(server_->Keys().empty()) << "with its marks";
}

TEST_F(S3BlobStoreTest, WaitsForRemovalUnderWay) {
  const FileDigest digest = blobs_->PutBytes("x");
  const std::string removing = KeyOfBlob("removing", digest.sha256);
  options_.touch_memory = std::chrono::milliseconds(0);
  Open();
  server_->Set(R"({"write": {")" + removing + R"(": "of another server"}})");
  EXPECT_FALSE(blobs_->RemoveIfUntouched(*blobs_->Look(digest.sha256)));
  std::thread end([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    server_->Set(R"({"remove": [")" + KeyOfBlob("blobs", digest.sha256) + "\", \"" + removing +
                 R"("]})");
  });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(blobs_->Touch(digest)) << "it was removed";
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(400));
  end.join();
}

TEST_F(S3BlobStoreTest, RemovalOfAnEndedServerEnds) {
  const FileDigest digest = blobs_->PutBytes("x");
  options_.touch_memory = std::chrono::milliseconds(0);
  Open();
  server_->Set(R"({"write": {")" + KeyOfBlob("removing", digest.sha256) + R"(": "dead"}})");
  server_->Set(R"({"age": [700]})");
  EXPECT_TRUE(blobs_->Touch(digest));
  EXPECT_FALSE(Has(KeyOfBlob("removing", digest.sha256)));
}

// A removal whose requests fail leaves the blob, and does not block it.
TEST_F(S3BlobStoreTest, FailedRemovalLeavesTheBlob) {
  const FileDigest digest = blobs_->PutBytes("x");
  const StoredBlob seen = *blobs_->Look(digest.sha256);
  server_->Fail("HEAD touched/", 100, R"("kind": "status", "status": 403)");
  EXPECT_EQ(ReasonThrown([&] { blobs_->RemoveIfUntouched(seen); }), "UNAVAILABLE");
  server_->EndFaults();
  EXPECT_FALSE(Has(KeyOfBlob("removing", digest.sha256)));
  EXPECT_TRUE(blobs_->RemoveIfUntouched(seen));
}

TEST_F(S3BlobStoreTest, RemovesLeftoversOfTheStore) {
  const FileDigest kept = blobs_->PutBytes("kept"), gone = blobs_->PutBytes("gone");
  server_->Set(R"({"remove": [")" + KeyOfBlob("blobs", gone.sha256) + R"("], "write": {")" +
               KeyOfBlob("removing", gone.sha256) + R"(": "dead", "blobs/not-a-blob": "x"}})");
  // An upload in parts that nobody continues.
  server_->Fail("(DELETE|PUT) blobs.*uploadId", 100, R"("kind": "status", "status": 403)");
  const std::string large(size_t{11} << 20, 'l');
  EXPECT_EQ(ReasonThrown([&] { blobs_->PutBytes(large); }), "UNAVAILABLE");
  server_->EndFaults();
  EXPECT_EQ(server_->UnfinishedUploads(), 1);
  EXPECT_EQ(blobs_->RemoveLeftovers(std::chrono::hours(24)), 0) << "all is young";
  server_->Set(R"({"age": [90000]})");
  EXPECT_EQ(blobs_->RemoveLeftovers(std::chrono::hours(24)), 4)
      << "an upload, its mark, the mark of a removal and one of a blob that is gone";
  EXPECT_EQ(server_->UnfinishedUploads(), 0);
  EXPECT_TRUE(Has(KeyOfBlob("touched", kept.sha256)));
  EXPECT_TRUE(Has(KeyOfBlob("blobs", kept.sha256)));
  EXPECT_TRUE(Has("blobs/not-a-blob"));
}

TEST_F(S3BlobStoreTest, ListsBlobsOfManyPages) {
  server_->Set(R"({"page": 2})");
  for (int i = 0; i < 9; ++i) blobs_->PutBytes(std::to_string(i));
  server_->Set(R"({"write": {"blobs/aa/bb/not-a-digest": "x"}})");
  const ListedBlobs listed = ListBlobs(*blobs_, [] { return false; });
  EXPECT_EQ(listed.blobs.size(), 9u);
  EXPECT_TRUE(std::ranges::is_sorted(
      listed.blobs, {}, [](const StoredBlob& blob) { return blob.digest.sha256; }));
}

TEST_F(S3BlobStoreTest, WorksWithoutConditionalWrites) {
  server_->Set(R"({"conditions": false})");
  const FileDigest digest = blobs_->PutBytes("x");
  EXPECT_EQ(blobs_->PutBytes("x").sha256, digest.sha256);
  EXPECT_TRUE(blobs_->RemoveIfUntouched(*blobs_->Look(digest.sha256)));
}

}  // namespace
}  // namespace color3d
