#include "server/storage/blob_store.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using BlobStoreTest = StorageTest;

TEST_F(BlobStoreTest, BlobsAreNamedByDigestAndReadOnly) {
  const FileDigest digest = blobs_.PutBytes("hello");
  EXPECT_EQ(digest.sha256, Sha256Hex("hello"));
  EXPECT_EQ(blobs_.PutBytes("hello").sha256, digest.sha256) << "twice is fine";
  EXPECT_EQ(ReadFile(blobs_.Fetch(digest.sha256)), "hello");
  struct stat status {};
  ASSERT_EQ(::stat(blobs_.Fetch(digest.sha256).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0444u);
  EXPECT_TRUE(blobs_.Touch(digest));
  EXPECT_FALSE(blobs_.Touch({digest.sha256, 4})) << "another size is another blob";
  EXPECT_EQ(ReasonThrown([&] { blobs_.Fetch(Sha256Hex("no")); }), "BLOB_MISSING");
  EXPECT_EQ(ReasonThrown([&] { blobs_.Fetch("../../etc/passwd"); }), "INVALID_ARGUMENT");
}

TEST_F(BlobStoreTest, FilesAreMovedIn) {
  const fs::path file = scratch_.path() / "file";
  WriteFileAtomic(file, "content");
  const FileDigest digest = blobs_.PutFile(file);
  EXPECT_FALSE(fs::exists(file));
  WriteFileAtomic(file, "content");
  EXPECT_EQ(blobs_.PutFile(file).sha256, digest.sha256);
  EXPECT_FALSE(fs::exists(file)) << "a duplicate is dropped";
}

TEST_F(BlobStoreTest, SweepKeepsReferencedAndYoungBlobs) {
  const FileDigest kept = blobs_.PutBytes("kept");
  const FileDigest young = blobs_.PutBytes("young");
  const FileDigest old = blobs_.PutBytes("old");
  const FileDigest touched = blobs_.PutBytes("touched");
  for (const FileDigest& digest : {kept, old, touched}) MakeOld(blobs_.Fetch(digest.sha256), 48);
  EXPECT_TRUE(blobs_.Touch(touched)) << "FindMissingBlobs has promised that it stays";
  const BlobStore::Sweep sweep = blobs_.RemoveUnreferenced({kept.sha256}, std::chrono::hours(24));
  EXPECT_EQ(sweep.removed, 1);
  EXPECT_EQ(sweep.bytes, 3);
  EXPECT_TRUE(blobs_.Touch(kept));
  EXPECT_TRUE(blobs_.Touch(young));
  EXPECT_TRUE(blobs_.Touch(touched));
  EXPECT_FALSE(blobs_.Touch(old));
}

TEST_F(BlobStoreTest, ReserveOfFreeSpaceIsKept) {
  BlobStore full(scratch_.path() / "full", {int64_t{1} << 60});
  EXPECT_EQ(ReasonThrown([&] { full.PutBytes("x"); }), "STORAGE_FULL");
  UploadStore uploads(scratch_.path() / "uploads2", full, 1000);
  EXPECT_EQ(ReasonThrown([&] { uploads.Open({"u", DigestOf("x")}, 0); }), "STORAGE_FULL");
}

}  // namespace
}  // namespace color3d
