#include "core/base/file_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

#include "core/base/digest.h"
#include "core/base/files.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

const std::string kKey = Sha256Hex("key");
const std::string kOther = Sha256Hex("other");

class FileCacheTest : public ::testing::Test {
 protected:
  fs::path Folder() const { return scratch_.path() / "cache"; }
  ScratchFolder scratch_;
  FileCache cache_{Folder(), 1 << 20};
};

TEST_F(FileCacheTest, ReturnsStoredValue) {
  EXPECT_FALSE(cache_.Get(kKey));
  const std::string bytes("a\0b\n", 4);
  cache_.Put(kKey, bytes);
  EXPECT_EQ(cache_.Get(kKey), bytes);
  cache_.Put(kKey, "");
  EXPECT_EQ(cache_.Get(kKey), "");
  EXPECT_FALSE(cache_.Get(kOther));
  EXPECT_FALSE(cache_.Get("../etc/passwd"));
}

TEST_F(FileCacheTest, DamagedAndMisplacedEntriesAreAbsent) {
  const std::string bytes(1000, 'x');
  const fs::path file = Folder() / kKey;
  cache_.Put(kKey, bytes);
  const std::string stored = ReadFile(file);
  for (size_t size : {size_t{0}, size_t{10}, size_t{64}, stored.size() - 1}) {
    WriteFileAtomic(file, stored.substr(0, size));
    EXPECT_FALSE(cache_.Get(kKey)) << size;
    EXPECT_FALSE(fs::exists(file)) << "a damaged entry stays for ever";
  }
  std::string flipped = stored;
  flipped[500] ^= 1;
  WriteFileAtomic(file, flipped);
  EXPECT_FALSE(cache_.Get(kKey));
  WriteFileAtomic(Folder() / kOther, stored);
  EXPECT_FALSE(cache_.Get(kOther));
  cache_.Put(kKey, bytes);
  EXPECT_EQ(cache_.Get(kKey), bytes);
}

TEST_F(FileCacheTest, TrimRemovesLeastRecentlyUsed) {
  const FileCache small(Folder(), 2500);
  std::vector<std::string> keys;
  for (int i = 0; i < 4; ++i) {
    keys.push_back(Sha256Hex(std::to_string(i)));
    small.Put(keys.back(), std::string(1000, 'a'));
    fs::last_write_time(Folder() / keys.back(),
                        fs::file_time_type::clock::now() - std::chrono::minutes(10 - i));
  }
  EXPECT_TRUE(small.Get(keys[0]));  // used now
  WriteFileAtomic(Folder() / ".put-1-1", "left by a writer that died");
  fs::last_write_time(Folder() / ".put-1-1",
                      fs::file_time_type::clock::now() - std::chrono::hours(2));
  small.Trim();
  EXPECT_TRUE(small.Get(keys[0]));
  EXPECT_FALSE(small.Get(keys[1]));
  EXPECT_FALSE(small.Get(keys[2]));
  EXPECT_TRUE(small.Get(keys[3]));
  EXPECT_FALSE(fs::exists(Folder() / ".put-1-1"));
}

TEST_F(FileCacheTest, KeepsNothingWithoutWritableFolder) {
  const FileCache none("", 100);
  none.Put(kKey, "x");
  none.Trim();
  EXPECT_FALSE(none.Get(kKey));
  WriteFileAtomic(scratch_.path() / "file", "");
  const FileCache blocked(scratch_.path() / "file" / "below", 100);
  blocked.Put(kKey, "x");
  blocked.Trim();
  EXPECT_FALSE(blocked.Get(kKey));
}

TEST_F(FileCacheTest, ConcurrentReadersSeeWholeEntries) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      const std::string own(5000, static_cast<char>('a' + t));
      for (int i = 0; i < 50; ++i) {
        cache_.Put(kKey, own);
        const auto seen = cache_.Get(kKey);
        EXPECT_TRUE(!seen || *seen == std::string(5000, (*seen)[0]));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(cache_.Get(kKey));
}

}  // namespace
}  // namespace color3d
