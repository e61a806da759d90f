#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <ctime>

#include "core/base/files.h"
#include "server/service_error.h"
#include "server/storage/blob_store.h"
#include "server/storage/data_folder.h"
#include "server/storage/upload_store.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

template <typename Body>
std::string ReasonThrown(const Body& body) {
  try {
    body();
  } catch (const Error& e) {
    return ReasonOf(e);
  }
  return "nothing";
}

void MakeOld(const fs::path& path, int hours) {
  timespec times[2] = {};
  times[0].tv_sec = times[1].tv_sec = ::time(nullptr) - hours * 3600;
  ASSERT_EQ(::utimensat(AT_FDCWD, path.c_str(), times, 0), 0);
}

class StorageTest : public ::testing::Test {
 protected:
  FileDigest DigestOf(const std::string& text) {
    return {Sha256Hex(text), static_cast<int64_t>(text.size())};
  }
  ScratchFolder scratch_;
  BlobStore blobs_{scratch_.path() / "blobs", {0}};
  UploadStore uploads_{scratch_.path() / "uploads", blobs_, 1000};
};

TEST_F(StorageTest, BlobsAreNamedByDigestAndReadOnly) {
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

TEST_F(StorageTest, FilesAreMovedIn) {
  const fs::path file = scratch_.path() / "file";
  WriteFileAtomic(file, "content");
  const FileDigest digest = blobs_.PutFile(file);
  EXPECT_FALSE(fs::exists(file));
  WriteFileAtomic(file, "content");
  EXPECT_EQ(blobs_.PutFile(file).sha256, digest.sha256);
  EXPECT_FALSE(fs::exists(file)) << "a duplicate is dropped";
}

TEST_F(StorageTest, SweepKeepsReferencedAndYoungBlobs) {
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

TEST_F(StorageTest, ReserveOfFreeSpaceIsKept) {
  BlobStore full(scratch_.path() / "full", {int64_t{1} << 60});
  EXPECT_EQ(ReasonThrown([&] { full.PutBytes("x"); }), "STORAGE_FULL");
  UploadStore uploads(scratch_.path() / "uploads2", full, 1000);
  EXPECT_EQ(ReasonThrown([&] { uploads.Open({"u", DigestOf("x")}, 0); }), "STORAGE_FULL");
}

TEST_F(StorageTest, UploadResumesWhereItStopped) {
  const UploadName name{"3f0c", DigestOf("hello world")};
  EXPECT_EQ(uploads_.Status(name).committed_size, 0);
  {
    auto writer = uploads_.Open(name, 0);
    writer->Append(0, "hello");
  }  // the connection breaks
  EXPECT_EQ(uploads_.Status(name).committed_size, 5);
  EXPECT_EQ(ReasonThrown([&] { uploads_.Open(name, 0); }), "OFFSET_MISMATCH");
  auto writer = uploads_.Open(name, 5);
  writer->Append(5, " wor");
  EXPECT_EQ(ReasonThrown([&] { writer->Append(8, "ld"); }), "OFFSET_MISMATCH");
  EXPECT_EQ(ReasonThrown([&] { writer->Finish(); }), "SIZE_MISMATCH");
  writer->Append(9, "ld");
  EXPECT_EQ(ReasonThrown([&] { writer->Append(11, "!"); }), "SIZE_MISMATCH");
  writer->Finish();
  EXPECT_TRUE(uploads_.Status(name).complete);
  EXPECT_EQ(ReadFile(blobs_.Fetch(name.digest.sha256)), "hello world");
  EXPECT_TRUE(ListFiles(scratch_.path() / "uploads").empty());
}

TEST_F(StorageTest, WrongBytesAreDropped) {
  const UploadName name{"u", DigestOf("right")};
  auto writer = uploads_.Open(name, 0);
  writer->Append(0, "wrong");
  EXPECT_EQ(ReasonThrown([&] { writer->Finish(); }), "DIGEST_MISMATCH");
  writer.reset();
  EXPECT_FALSE(blobs_.Touch(name.digest));
  EXPECT_EQ(uploads_.Status(name).committed_size, 0) << "starts afresh";
}

TEST_F(StorageTest, ReconnectedClientTakesItsUploadOver) {
  const UploadName name{"u", DigestOf("abcdef")};
  auto first = uploads_.Open(name, 0);
  first->Append(0, "abc");
  auto second = uploads_.Open(name, 3);
  EXPECT_EQ(ReasonThrown([&] { first->Append(3, "xyz"); }), "UPLOAD_TAKEN_OVER");
  first.reset();
  second->Append(3, "def");
  second->Finish();
  EXPECT_TRUE(blobs_.Touch(name.digest));
}

TEST_F(StorageTest, HostileNamesAndSizesAreRefused) {
  EXPECT_THROW(uploads_.Open({"../../x", DigestOf("a")}, 0), Error);
  EXPECT_THROW(uploads_.Open({"", DigestOf("a")}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {"zz", 1}}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {Sha256Hex("a"), -1}}, 0), Error);
  EXPECT_THROW(uploads_.Open({"u", {Sha256Hex("a"), 1001}}, 0), Error);
  EXPECT_TRUE(ListFiles(scratch_.path() / "uploads").empty());
}

TEST_F(StorageTest, DeadUploadsAreReaped) {
  const UploadName name{"u", DigestOf("abc")};
  uploads_.Open(name, 0)->Append(0, "a");
  EXPECT_EQ(uploads_.ReapOlderThan(std::chrono::hours(24)), 0);
  for (const std::string& file : ListFiles(scratch_.path() / "uploads")) {
    MakeOld(scratch_.path() / "uploads" / file, 25);
  }
  EXPECT_EQ(uploads_.ReapOlderThan(std::chrono::hours(24)), 1);
  EXPECT_EQ(uploads_.Status(name).committed_size, 0);
}

TEST_F(StorageTest, EmptyBlobs) {
  const UploadName name{"u", DigestOf("")};
  uploads_.Open(name, 0)->Finish();
  EXPECT_TRUE(uploads_.Status(name).complete);
}

TEST(DataFolder, SecondServerIsKeptOut) {
  ScratchFolder scratch;
  const DataPaths paths(scratch.path() / "data");
  PrepareDataFolder(paths);
  {
    DataFolderLock lock(paths);
    EXPECT_EQ(ReasonThrown([&] { DataFolderLock second(paths); }), "FAILED_PRECONDITION");
  }
  DataFolderLock again(paths);
}

TEST(DataFolder, UnusableFolderIsReported) {
  ScratchFolder scratch;
  WriteFileAtomic(scratch.path() / "file", "x");
  EXPECT_EQ(ReasonThrown([&] { PrepareDataFolder(DataPaths(scratch.path() / "file")); }),
            "FAILED_PRECONDITION");
}

}  // namespace
}  // namespace color3d
