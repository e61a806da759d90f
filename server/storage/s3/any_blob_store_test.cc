// What every blob store does: run on the folder, on the scripted object store, and on s3rver where
// npm has installed it in tests/.npm.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <map>
#include <memory>
#include <thread>
#include <tuple>

#include "server/storage/s3/s3_blob_store.h"
#include "tests/support/service/s3_process.h"
#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::S3Process;
using testing::S3rverProcess;

// Other bytes of the same number.
void FlipByte(const fs::path& file) {
  ::chmod(file.c_str(), 0644);
  std::string bytes = ReadFile(file);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(file, std::ios::binary) << bytes;
}

class AnyBlobStoreTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string kind = GetParam();
    if (kind == "s3rver" && S3rverProcess::Program().empty()) {
      GTEST_SKIP() << "NOT TESTED: npm install --prefix tests/.npm s3rver";
    }
    if (kind == "s3" && !S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    if (kind == "s3") scripted_ = std::make_unique<S3Process>(scratch_.path());
    if (kind == "s3rver") s3rver_ = std::make_unique<S3rverProcess>(scratch_.path());
    blobs_ = Open("one");
    other_ = Open("two");
  }

  // Another server on the same store. `name`: of its folder.
  std::unique_ptr<BlobStore> Open(const std::string& name) {
    if (!scripted_ && !s3rver_) {
      return std::make_unique<FileBlobStore>(scratch_.path() / "blobs", BlobStoreOptions{0});
    }
    S3BlobOptions options;
    options.s3 = scripted_ ? scripted_->Options("some/prefix") : s3rver_->Options();
    options.folder = scratch_.path() / name;
    options.reserve_bytes = 0;
    if (is_contested_) {
      options.touch_memory = std::chrono::milliseconds(0);
      options.young_mark = std::chrono::seconds(0);
    }
    return std::make_unique<S3BlobStore>(options);
  }

  void Damage(const FileDigest& digest) {
    const std::string& sha256 = digest.sha256;
    const std::string key =
        "blobs/" + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256;
    if (scripted_) return scripted_->Set(R"({"damage": ["some/prefix/)" + key + R"("]})");
    if (s3rver_) {
      return FlipByte(scratch_.path() / "s3rver" / "blobs" / (key + "._S3rver_object"));
    }
    FlipByte(scratch_.path() / key);
  }

  static std::string Read(const BlobStore& blobs, const FileDigest& digest) {
    std::string bytes;
    blobs.Borrow(digest.sha256, [&](const fs::path& file) { bytes = ReadFile(file); });
    return bytes;
  }
  static std::map<std::string, StoredBlob> All(const BlobStore& blobs) {
    std::map<std::string, StoredBlob> all;
    blobs.ForEach([&](const StoredBlob& blob) {
      all[blob.digest.sha256] = blob;
      return true;
    });
    return all;
  }

  ScratchFolder scratch_;
  std::unique_ptr<S3Process> scripted_;
  std::unique_ptr<S3rverProcess> s3rver_;
  std::unique_ptr<BlobStore> blobs_, other_;
  bool is_contested_ = false;  // stores protect touches by their marks alone
};

TEST_P(AnyBlobStoreTest, BlobsAreNamedByDigestAndReadOnly) {
  const FileDigest digest = blobs_->PutBytes("hello");
  EXPECT_EQ(digest.sha256, Sha256Hex("hello"));
  EXPECT_EQ(blobs_->PutBytes("hello").sha256, digest.sha256) << "twice is fine";
  for (const auto& store : {std::cref(*blobs_), std::cref(*other_)}) {
    EXPECT_EQ(Read(store, digest), "hello");
    EXPECT_TRUE(store.get().Touch(digest));
    EXPECT_FALSE(store.get().Touch({digest.sha256, 4})) << "another size is another blob";
    ASSERT_TRUE(store.get().Look(digest.sha256).has_value());
    EXPECT_EQ(store.get().Look(digest.sha256)->digest.size_bytes, 5);
    EXPECT_FALSE(store.get().Look(Sha256Hex("no")).has_value());
  }
  blobs_->Borrow(digest.sha256, [](const fs::path& file) {
    struct stat status {};
    ASSERT_EQ(::stat(file.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0444u);
  });
  const auto nothing = [](const fs::path&) {};
  EXPECT_EQ(ReasonThrown([&] { blobs_->Borrow(Sha256Hex("no"), nothing); }), "BLOB_MISSING");
  EXPECT_EQ(ReasonThrown([&] { blobs_->IsIntact(DigestOfBytes("no")); }), "BLOB_MISSING");
  for (const char* name : {"../../etc/passwd", "", "ABC"}) {
    EXPECT_EQ(ReasonThrown([&] { blobs_->Borrow(name, nothing); }), "INVALID_ARGUMENT");
    EXPECT_EQ(ReasonThrown([&] { blobs_->Look(name); }), "INVALID_ARGUMENT");
    EXPECT_EQ(ReasonThrown([&] { blobs_->Remove(name); }), "INVALID_ARGUMENT");
  }
}

TEST_P(AnyBlobStoreTest, EmptyBlobIsABlob) {
  const FileDigest digest = blobs_->PutBytes("");
  EXPECT_EQ(Read(*other_, digest), "");
  EXPECT_TRUE(other_->Touch(digest));
  EXPECT_TRUE(blobs_->IsIntact(digest));
}

TEST_P(AnyBlobStoreTest, MovesFilesIn) {
  const fs::path file = scratch_.path() / "file";
  WriteFileAtomic(file, "content");
  const FileDigest digest = blobs_->PutFile(file);
  EXPECT_FALSE(fs::exists(file));
  WriteFileAtomic(file, "content");
  EXPECT_EQ(blobs_->PutFile(file).sha256, digest.sha256);
  EXPECT_FALSE(fs::exists(file)) << "a duplicate is dropped";
  EXPECT_EQ(Read(*other_, digest), "content");
}

// Beyond the size that is written at once.
TEST_P(AnyBlobStoreTest, KeepsLargeFiles) {
  std::string bytes;
  for (int i = 0; bytes.size() < (size_t{12} << 20) + 7; ++i) bytes += std::to_string(i) + "\n";
  const fs::path file = scratch_.path() / "file";
  WriteFileAtomic(file, bytes);
  const FileDigest digest = blobs_->PutFile(file);
  EXPECT_EQ(digest.size_bytes, static_cast<int64_t>(bytes.size()));
  EXPECT_TRUE(Read(*other_, digest) == bytes);
  EXPECT_TRUE(other_->IsIntact(digest));
}

TEST_P(AnyBlobStoreTest, RemovesUntouchedBlobsOnly) {
  const FileDigest idle = blobs_->PutBytes("idle"), touched = blobs_->PutBytes("touched");
  const FileDigest put = blobs_->PutBytes("put");
  const auto before = All(*blobs_);
  EXPECT_EQ(before.size(), 3u);
  EXPECT_EQ(before.at(idle.sha256).digest.size_bytes, 4);
  EXPECT_EQ(blobs_->Look(idle.sha256)->touched_ns, before.at(idle.sha256).touched_ns);
  EXPECT_TRUE(blobs_->Touch(touched)) << "FindMissingBlobs has promised that it stays";
  blobs_->PutBytes("put");
  EXPECT_TRUE(blobs_->RemoveIfUntouched(before.at(idle.sha256)));
  EXPECT_FALSE(blobs_->RemoveIfUntouched(before.at(idle.sha256))) << "gone";
  EXPECT_FALSE(blobs_->RemoveIfUntouched(before.at(touched.sha256)));
  EXPECT_FALSE(blobs_->RemoveIfUntouched(before.at(put.sha256)));
  EXPECT_EQ(All(*other_).size(), 2u);
  EXPECT_FALSE(blobs_->Touch(idle));
  EXPECT_FALSE(other_->Touch(idle));
}

// Also those that the other server's cache still promises.
TEST_P(AnyBlobStoreTest, ServersSeeTouchesOfEachOther) {
  const FileDigest digest = blobs_->PutBytes("shared");
  const StoredBlob before = *blobs_->Look(digest.sha256);
  EXPECT_TRUE(other_->Touch(digest));
  EXPECT_FALSE(blobs_->RemoveIfUntouched(before));
  const StoredBlob now = *blobs_->Look(digest.sha256);
  EXPECT_NE(now.touched_ns, before.touched_ns);
  EXPECT_TRUE(other_->Touch(digest));
  EXPECT_FALSE(blobs_->RemoveIfUntouched(now));
  EXPECT_EQ(Read(*blobs_, digest), "shared");
}

TEST_P(AnyBlobStoreTest, EachTouchChangesTime) {
  const FileDigest digest = blobs_->PutBytes("x");
  std::optional<StoredBlob> before = blobs_->Look(digest.sha256);
  ASSERT_TRUE(before.has_value());
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(blobs_->Touch(digest));
    const auto now = blobs_->Look(digest.sha256);
    EXPECT_NE(now->touched_ns, before->touched_ns) << "though no time may have passed";
    before = now;
  }
}

TEST_P(AnyBlobStoreTest, TouchesManyAtOnce) {
  std::vector<FileDigest> digests;
  for (int i = 0; i < 40; ++i) {
    const std::string text = "blob " + std::to_string(i);
    digests.push_back(i % 3 == 0 ? DigestOfBytes(text) : blobs_->PutBytes(text));
  }
  const std::vector<bool> stored = other_->TouchAll(digests);
  ASSERT_EQ(stored.size(), digests.size());
  for (size_t i = 0; i < digests.size(); ++i) EXPECT_EQ(stored[i], i % 3 != 0) << i;
  EXPECT_TRUE(other_->TouchAll({}).empty());
}

TEST_P(AnyBlobStoreTest, PutReplacesDamagedBytes) {
  const FileDigest digest = blobs_->PutBytes("some bytes");
  Damage(digest);
  EXPECT_FALSE(blobs_->IsIntact(digest));
  blobs_->PutBytes("some bytes");
  EXPECT_TRUE(blobs_->IsIntact(digest));
  EXPECT_EQ(blobs_->damaged(), 1);
  Damage(digest);
  const fs::path file = scratch_.path() / "again";
  WriteFileAtomic(file, "some bytes");
  blobs_->PutFile(file);
  EXPECT_TRUE(blobs_->IsIntact(digest));
  Damage(digest);
  EXPECT_TRUE(blobs_->SetAside(digest.sha256));
  EXPECT_FALSE(blobs_->Touch(digest));
  blobs_->PutBytes("some bytes");
  EXPECT_TRUE(blobs_->IsIntact(digest));
  EXPECT_EQ(Read(*other_, digest), "some bytes");
}

TEST_P(AnyBlobStoreTest, SetsAsideDamagedBlobsOnly) {
  const FileDigest digest = blobs_->PutBytes("some bytes");
  EXPECT_FALSE(blobs_->SetAside(digest.sha256));
  EXPECT_TRUE(blobs_->Touch(digest));
  Damage(digest);
  EXPECT_TRUE(blobs_->SetAside(digest.sha256));
  EXPECT_EQ(blobs_->damaged(), 1);
  EXPECT_FALSE(blobs_->SetAside(digest.sha256)) << "gone";
}

TEST_P(AnyBlobStoreTest, BorrowedFileCanBeLinked) {
  const FileDigest digest = blobs_->PutBytes("linked");
  const fs::path link = scratch_.path() / "link";
  blobs_->Borrow(digest.sha256, [&](const fs::path& file) { fs::create_hard_link(file, link); });
  blobs_->Remove(digest.sha256);
  EXPECT_EQ(ReadFile(link), "linked");
  EXPECT_FALSE(blobs_->Look(digest.sha256).has_value());
}

// Either the touch or the removal succeeds, never both, whichever way their requests interleave.
TEST_P(AnyBlobStoreTest, TouchesAndRemovalsExcludeEachOther) {
  constexpr int kRounds = 60;
  is_contested_ = true;
  const auto user = Open("user"), remover = Open("remover");
  const FileDigest digest = DigestOfBytes("contested");
  int touches = 0, removals = 0;
  for (int i = 0; i < kRounds; ++i) {
    user->PutBytes("contested");
    const std::optional<StoredBlob> seen = remover->Look(digest.sha256);
    ASSERT_TRUE(seen.has_value());
    bool touched = false, removed = false;
    std::thread removal([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(50 * (i % 20)));
      removed = remover->RemoveIfUntouched(*seen);
    });
    std::this_thread::sleep_for(std::chrono::microseconds(50 * ((7 * i) % 20)));
    touched = user->Touch(digest);
    removal.join();
    EXPECT_FALSE(touched && removed) << "round " << i;
    EXPECT_EQ(user->Look(digest.sha256).has_value(), !removed);
    touches += touched ? 1 : 0;
    removals += removed ? 1 : 0;
  }
  RecordProperty("touches", touches);
  RecordProperty("removals", removals);
  EXPECT_GT(touches, 0);
}

TEST_P(AnyBlobStoreTest, ManyThreadsStoreTheSame) {
  // s3rver replaces its files in place: for a moment they may be missing.
  const auto put = [&](BlobStore& store, const std::string& text) {
    for (int tries = 1;; ++tries) {
      try {
        return store.PutBytes(text);
      } catch (const Error& error) {
        const bool may_pass = error.code() == ErrorCode::kUnavailable && tries < 5;
        if (std::string_view(GetParam()) != "s3rver" || !may_pass) throw;
      }
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] {
      BlobStore& store = i % 2 == 0 ? *blobs_ : *other_;
      for (int k = 0; k < 5; ++k) {
        const std::string text = "text " + std::to_string(k);
        EXPECT_EQ(Read(store, put(store, text)), text);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(All(*blobs_).size(), 5u);
}

TEST_P(AnyBlobStoreTest, UploadBecomesBlob) {
  UploadStore uploads(scratch_.path() / "uploads", *blobs_, 1000);
  const FileDigest digest = DigestOfBytes("hello world");
  auto writer = uploads.Open({"u", digest}, 0);
  writer->Append(0, "hello ");
  writer->Append(6, "world");
  writer->Finish();
  writer.reset();
  EXPECT_EQ(Read(*other_, digest), "hello world");
  EXPECT_EQ(uploads.CommittedSize({"u", digest}), 0);
}

INSTANTIATE_TEST_SUITE_P(Stores,
                         AnyBlobStoreTest,
                         ::testing::Values("folder", "s3", "s3rver"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace color3d
