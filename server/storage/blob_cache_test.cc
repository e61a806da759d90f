#include "server/storage/blob_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

constexpr int64_t kBlobBytes = 100;

class BlobCacheTest : public ::testing::Test {
 protected:
  // Content of blob `i`.
  static std::string Bytes(int i) { return std::string(kBlobBytes - 1, 'x') + char('a' + i); }
  static std::string Digest(int i) { return Sha256Hex(Bytes(i)); }
  fs::path FileOf(int i) const { return folder_ / Digest(i); }
  bool IsCached(int i) const { return fs::exists(FileOf(i)); }
  void Use(BlobCache& cache, int i, const std::function<void(const fs::path&)>& use = {}) {
    cache.Use(
        Digest(i),
        [&](const fs::path& part) {
          ++fills_;
          std::ofstream(part) << Bytes(i);
        },
        [&](const fs::path& file) {
          EXPECT_EQ(ReadFile(file), Bytes(i));
          if (use) use(file);
        });
  }

  ScratchFolder scratch_;
  const fs::path folder_ = scratch_.path() / "blobs";
  std::atomic<int> fills_{0};
};

TEST_F(BlobCacheTest, RemovesLeastRecentlyUsedBeyondBudget) {
  BlobCache cache(folder_, 3 * kBlobBytes);
  for (int i = 0; i < 3; ++i) Use(cache, i);
  Use(cache, 0);
  EXPECT_EQ(fills_, 3) << "0 was cached";
  Use(cache, 3);
  EXPECT_FALSE(IsCached(1)) << "used longest ago";
  for (const int i : {0, 2, 3}) EXPECT_TRUE(IsCached(i)) << i;
  EXPECT_EQ(cache.bytes(), 3 * kBlobBytes);
}

TEST_F(BlobCacheTest, NeverRemovesFilesInUse) {
  BlobCache cache(folder_, 2 * kBlobBytes);
  const fs::path link = scratch_.path() / "of a job";
  Use(cache, 0, [&](const fs::path& file) { fs::create_hard_link(file, link); });
  Use(cache, 1, [&](const fs::path& lent) {
    for (int i = 2; i < 6; ++i) Use(cache, i);
    EXPECT_TRUE(fs::exists(lent));
    EXPECT_TRUE(IsCached(0)) << "a job has a link to it";
  });
  EXPECT_EQ(cache.bytes(), 2 * kBlobBytes);
  fs::remove(link);
  Use(cache, 6);
  EXPECT_FALSE(IsCached(0)) << "its job has ended";
}

TEST_F(BlobCacheTest, LargeFileStaysWhileInUse) {
  BlobCache cache(folder_, kBlobBytes / 2);
  Use(cache, 0, [&](const fs::path& file) { EXPECT_TRUE(fs::exists(file)); });
  EXPECT_EQ(cache.bytes(), 0);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(BlobCacheTest, ConcurrentUsersFillOnce) {
  BlobCache cache(folder_, 10 * kBlobBytes);
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) threads.emplace_back([&] { Use(cache, 0); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(fills_, 1);
}

TEST_F(BlobCacheTest, FailedFillIsRepeatedByTheNext) {
  BlobCache cache(folder_, 10 * kBlobBytes);
  EXPECT_THROW(cache.Use(
                   Digest(0),
                   [](const fs::path&) { throw Error(ErrorCode::kUnavailable, "cut"); },
                   [](const fs::path&) {}),
               Error);
  Use(cache, 0);
  EXPECT_EQ(fills_, 1);
  EXPECT_EQ(cache.bytes(), kBlobBytes);
}

TEST_F(BlobCacheTest, KeepsFilesAndTheirOrderOverRestart) {
  {
    BlobCache cache(folder_, 10 * kBlobBytes);
    for (int i = 0; i < 3; ++i) {
      Use(cache, i);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // file times
    }
    Use(cache, 0);
  }
  std::ofstream(folder_ / (Digest(9) + ".part")) << "half";
  {
    const fs::path damaged = FileOf(2);
    fs::permissions(damaged, fs::perms::owner_all);
    const auto time = fs::last_write_time(damaged);
    std::ofstream(damaged) << std::string(kBlobBytes, '?');
    fs::last_write_time(damaged, time);
  }
  BlobCache cache(folder_, 2 * kBlobBytes);
  EXPECT_FALSE(IsCached(1)) << "used longest ago";
  EXPECT_FALSE(fs::exists(folder_ / (Digest(9) + ".part")));
  EXPECT_EQ(cache.bytes(), 2 * kBlobBytes);
  fills_ = 0;
  Use(cache, 0);
  EXPECT_EQ(fills_, 0);
  Use(cache, 2);
  EXPECT_EQ(fills_, 1) << "a damaged file was used";
}

TEST_F(BlobCacheTest, PutMovesFileAndDropsSecondCopy) {
  BlobCache cache(folder_, 10 * kBlobBytes);
  for (int round = 0; round < 2; ++round) {
    const fs::path file = scratch_.path() / "result";
    WriteFileAtomic(file, Bytes(0));
    cache.Put(file, DigestFile(file));
    EXPECT_FALSE(fs::exists(file));
    EXPECT_EQ(cache.bytes(), kBlobBytes);
  }
  Use(cache, 0);
  EXPECT_EQ(fills_, 0);
}

}  // namespace
}  // namespace color3d
