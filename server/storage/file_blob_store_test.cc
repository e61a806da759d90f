// What is special about blobs in a folder; s3/any_blob_store_test.cc has what all stores do.
#include "server/storage/file_blob_store.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <map>
#include <optional>

#include "tests/support/service/storage_fixture.h"
#include "tests/support/unprivileged.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using FileBlobStoreTest = StorageTest;

TEST_F(FileBlobStoreTest, BlobsAreNamedByDigestAndReadOnly) {
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

// At least one of the folders is on another file system than the blobs.
TEST_F(FileBlobStoreTest, MovesFilesInFromAnotherDisk) {
  for (const fs::path& folder : {fs::path("/dev/shm"), fs::temp_directory_path()}) {
    if (!fs::is_directory(folder)) continue;
    const fs::path file = folder / ("color3d-blob-" + std::to_string(::getpid()));
    WriteFileAtomic(file, "from " + folder.string());
    const FileDigest digest = blobs_.PutFile(file);
    EXPECT_FALSE(fs::exists(file));
    EXPECT_EQ(ReadFile(blobs_.Fetch(digest.sha256)), "from " + folder.string());
    EXPECT_EQ(blobs_.RemoveLeftovers(std::chrono::seconds(0)), 0);
  }
}

TEST_F(FileBlobStoreTest, RemovesUntouchedBlobsOnly) {
  const auto stored = [&] {
    std::map<std::string, StoredBlob> all;
    blobs_.ForEach([&](const StoredBlob& blob) {
      all[blob.digest.sha256] = blob;
      return true;
    });
    return all;
  };
  const FileDigest idle = blobs_.PutBytes("idle"), touched = blobs_.PutBytes("touched");
  const FileDigest put = blobs_.PutBytes("put");
  for (const FileDigest& digest : {idle, touched, put}) MakeOld(blobs_.Fetch(digest.sha256), 48);
  const auto before = stored();
  EXPECT_EQ(before.size(), 3u);
  EXPECT_EQ(before.at(idle.sha256).digest.size_bytes, 4);
  EXPECT_TRUE(blobs_.Touch(touched)) << "FindMissingBlobs has promised that it stays";
  blobs_.PutBytes("put");
  EXPECT_TRUE(blobs_.RemoveIfUntouched(before.at(idle.sha256)));
  EXPECT_FALSE(blobs_.RemoveIfUntouched(before.at(idle.sha256))) << "gone";
  EXPECT_FALSE(blobs_.RemoveIfUntouched(before.at(touched.sha256)));
  EXPECT_FALSE(blobs_.RemoveIfUntouched(before.at(put.sha256)));
  EXPECT_EQ(stored().size(), 2u);
}

TEST_F(FileBlobStoreTest, SweepDoesNotWaitForBusyStore) {
  const FileDigest digest = blobs_.PutBytes("idle");
  std::optional<StoredBlob> blob;
  blobs_.ForEach([&](const StoredBlob& found) {
    blob = found;
    return true;
  });
  const int other = ::open((scratch_.path() / "blobs" / ".lock").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(other, 0);
  ASSERT_EQ(::flock(other, LOCK_SH), 0);
  EXPECT_FALSE(blobs_.RemoveIfUntouched(*blob));
  ::close(other);
  EXPECT_TRUE(blobs_.RemoveIfUntouched(*blob));
  EXPECT_FALSE(blobs_.Touch(digest));
}

TEST_F(FileBlobStoreTest, RemovesLeftoversOfCrash) {
  const fs::path folder = scratch_.path() / "blobs" / "ab";
  fs::create_directories(folder);
  for (const char* name : {".x.1.0.part", "y.damaged", "new.part"}) {
    WriteFileAtomic(folder / name, "x");
  }
  MakeOld(folder / ".x.1.0.part", 48);
  MakeOld(folder / "y.damaged", 48);
  EXPECT_EQ(blobs_.RemoveLeftovers(std::chrono::hours(24)), 0) << "the clock may have been set";
  EXPECT_EQ(blobs_.RemoveLeftovers(std::chrono::hours(24)), 2);
  EXPECT_TRUE(fs::exists(folder / "new.part"));
}

TEST_F(FileBlobStoreTest, EachTouchChangesTime) {
  const FileDigest digest = blobs_.PutBytes("x");
  std::optional<StoredBlob> before = blobs_.Look(digest.sha256);
  ASSERT_TRUE(before.has_value());
  EXPECT_EQ(before->digest.size_bytes, 1);
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(blobs_.Touch(digest));
    const auto now = blobs_.Look(digest.sha256);
    EXPECT_NE(now->touched_ns, before->touched_ns) << "though no time may have passed";
    before = now;
  }
  EXPECT_FALSE(blobs_.Look(Sha256Hex("no")).has_value());
}

class UnreadableBlobsTest : private testing::Unprivileged, public StorageTest {};

TEST_F(UnreadableBlobsTest, UnreadableBlobsAreNotMissing) {
  const FileDigest lost = blobs_.PutBytes("lost"), other = blobs_.PutBytes("other");
  const fs::path folder = blobs_.Fetch(lost.sha256).parent_path();
  fs::permissions(folder, fs::perms::none);
  EXPECT_EQ(ReasonThrown([&] { blobs_.Fetch(lost.sha256); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_.Touch(lost); }), "BLOB_UNREADABLE");
  EXPECT_EQ(ReasonThrown([&] { blobs_.Look(lost.sha256); }), "BLOB_UNREADABLE");
  const ListedBlobs listed = ListBlobs(blobs_, [] { return false; });
  ASSERT_EQ(listed.blobs.size(), 1u);
  EXPECT_EQ(listed.blobs[0].digest.sha256, other.sha256);
  ASSERT_EQ(listed.unreadable.size(), 1u);
  EXPECT_NE(listed.unreadable[0].find(folder.string()), std::string::npos);
  fs::permissions(folder, fs::perms::owner_all);
  EXPECT_TRUE(blobs_.Touch(lost));
}

TEST_F(FileBlobStoreTest, KeepsReserveOfFreeSpace) {
  FileBlobStore full(scratch_.path() / "full", {int64_t{1} << 60});
  EXPECT_EQ(ReasonThrown([&] { full.PutBytes("x"); }), "STORAGE_FULL");
  UploadStore uploads(scratch_.path() / "uploads2", full, 1000);
  EXPECT_EQ(ReasonThrown([&] { uploads.Open({"u", DigestOf("x")}, 0); }), "STORAGE_FULL");
}

TEST_F(FileBlobStoreTest, MissingFolderIsNotFullDisk) {
  FileBlobStore lost(scratch_.path() / "lost", {0});
  fs::remove_all(scratch_.path() / "lost");
  try {
    lost.RequireSpace(1);
    FAIL() << "there is no folder";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kUnavailable);
    EXPECT_NE(std::string(e.what()).find("is mounted"), std::string::npos);
  }
}

TEST_F(FileBlobStoreTest, ConcurrentUploadsReserveSpace) {
  const int64_t free = blobs_.FreeBytes();
  // Leaves room for one and a half of two uploads; other programs on this disk may change it a
  // little.
  const int64_t size = int64_t{512} << 20;
  if (free < 2 * size) GTEST_SKIP() << "too little space on this disk";
  FileBlobStore blobs(scratch_.path() / "tight", {free - size * 3 / 2});
  UploadStore uploads(scratch_.path() / "uploads3", blobs, size);
  auto first = uploads.Open({"a", {Sha256Hex("a"), size}}, 0);
  EXPECT_EQ(ReasonThrown([&] { uploads.Open({"b", {Sha256Hex("b"), size}}, 0); }), "STORAGE_FULL");
  first->Append(0, std::string(1000, 'x'));
  EXPECT_EQ(ReasonThrown([&] { uploads.Open({"b", {Sha256Hex("b"), size}}, 0); }), "STORAGE_FULL");
  first.reset();  // the client disconnected
  uploads.Open({"b", {Sha256Hex("b"), size}}, 0);
}

}  // namespace
}  // namespace color3d
