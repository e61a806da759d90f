#include <gtest/gtest.h>
#include <malloc.h>

#include <barrier>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <thread>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/base/subprocess.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

TEST(Sha256, MatchesPublishedVectors) {
  EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_TRUE(IsSha256Hex(Sha256Hex("x")));
  EXPECT_FALSE(IsSha256Hex("ABC"));
}

TEST(AvailableMemory, IsTheLeastOfWhatTheSystemAndTheGroupsLeave) {
  const ScratchFolder root;
  const auto put = [&](const std::string& file, const std::string& text) {
    fs::create_directories((root.path() / file).parent_path());
    WriteFileAtomic(root.path() / file, text);
  };
  EXPECT_EQ(AvailableMemoryBytes(root.path()), INT64_MAX);
  put("proc/meminfo", "MemTotal:  9000 kB\nMemAvailable:   5000 kB\n");
  EXPECT_EQ(AvailableMemoryBytes(root.path()), 5000 * 1024);
  put("proc/self/cgroup", "4:memory:/a/b\n0::/c/d\n");
  put("sys/fs/cgroup/c/memory.max", "4000000\n");
  put("sys/fs/cgroup/c/memory.current", "1000000\n");
  put("sys/fs/cgroup/c/d/memory.max", "max\n");
  EXPECT_EQ(AvailableMemoryBytes(root.path()), 3000000);
  put("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", "2500000\n");
  put("sys/fs/cgroup/memory/a/b/memory.usage_in_bytes", "2600000\n");
  EXPECT_EQ(AvailableMemoryBytes(root.path()), 0);  // over its limit: never negative
  EXPECT_GT(AvailableMemoryBytes(), 1 << 20);
}

TEST(Files, WriteIsAtomicAndReadable) {
  ScratchFolder scratch;
  const fs::path path = scratch.path() / "value.bin";
  WriteFileAtomic(path, "one");
  WriteFileAtomic(path, std::string("two\0three", 9));
  EXPECT_EQ(ReadFile(path), std::string("two\0three", 9));
  EXPECT_EQ(DigestFile(path).sha256, Sha256Hex(std::string("two\0three", 9)));
  EXPECT_EQ(ListFiles(scratch.path()), std::vector<std::string>{"value.bin"});
}

TEST(Files, ErrorsNameThePathAndLeaveNothing) {
  ScratchFolder scratch;
  try {
    WriteFileAtomic(scratch.path() / "missing" / "x", "y");
    FAIL() << "wrote into a folder that does not exist";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
    EXPECT_NE(std::string(e.what()).find("missing"), std::string::npos);
  }
  EXPECT_THROW(ReadFile(scratch.path() / "absent"), Error);
  EXPECT_THROW(ReadFile(scratch.path()), Error);
  EXPECT_TRUE(ListFiles(scratch.path()).empty());
}

TEST(Files, UnsafePathsAreRecognised) {
  for (const char* good : {"a.jpg", "images/a b.jpg", "x/..y/z"}) {
    EXPECT_TRUE(IsSafeRelativePath(good)) << good;
  }
  for (const char* bad : {"", "/etc/passwd", "../a", "a/../b", "a//b", "a/.", "a\\b", "a/\n"}) {
    EXPECT_FALSE(IsSafeRelativePath(bad)) << bad;
  }
}

TEST(ThreadPool, CoversEveryIndexOnceAndRethrows) {
  ThreadPool pool(3);
  std::vector<int> hits(1000, 0);
  pool.ForEach(1000, [&](int64_t i, int) { ++hits[i]; });
  pool.ForRanges(1000, [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) ++hits[i];
  });
  for (int h : hits) ASSERT_EQ(h, 2);
  EXPECT_THROW(pool.ForEach(100,
                            [](int64_t i, int) {
                              if (i == 57) throw InvalidArgument("x");
                            }),
               Error);
  int64_t sum = 0;
  ThreadPool single(1);
  single.ForEach(10, [&](int64_t i, int) { sum += i; });
  EXPECT_EQ(sum, 45);
}

TEST(Random, IsReproducibleAndResumable) {
  Random first(7);
  Random second(7);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(first.NextUint32(), second.NextUint32());
  Random resumed(first.state());
  EXPECT_EQ(first.NextUint32(), resumed.NextUint32());
  double mean = 0.0;
  double square = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double x = first.NextNormal();
    mean += x / 20000;
    square += x * x / 20000;
  }
  EXPECT_NEAR(mean, 0.0, 0.03);
  EXPECT_NEAR(square, 1.0, 0.05);
}

TEST(Subprocess, ReportsExitCodeLogTimeoutAndCancellation) {
  ScratchFolder scratch;
  CancellationToken cancel;
  SubprocessOptions options;
  options.arguments = {"sh", "-c", "echo $COLOR3D_TEST; exit 3"};
  options.environment = {"COLOR3D_TEST=hello"};
  options.log_path = scratch.path() / "log";
  EXPECT_EQ(RunSubprocess(options, cancel).exit_code, 3);
  EXPECT_EQ(ReadFile(options.log_path), "hello\n");

  options.arguments = {"sh", "-c", "sleep 60 & wait"};
  options.timeout = std::chrono::seconds(0);
  EXPECT_TRUE(RunSubprocess(options, cancel).timed_out);

  options.timeout = std::chrono::seconds(60);
  cancel.Cancel();
  EXPECT_THROW(RunSubprocess(options, cancel), Error);

  options.arguments = {"color3d-no-such-program"};
  CancellationToken fresh;
  try {
    RunSubprocess(options, fresh);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
  }
}

// Pools of a process in which eight threads hold memory at the same time.
int ArenasOfEightThreads() {
  std::barrier all(8);
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const std::vector<char> small(1000);
      all.arrive_and_wait();
    });
  }
  for (std::thread& thread : threads) thread.join();
  char* text = nullptr;
  size_t size = 0;
  std::FILE* file = ::open_memstream(&text, &size);
  ::malloc_info(0, file);
  std::fclose(file);
  int count = 0;
  for (const char* at = text; (at = std::strstr(at, "<heap nr=")) != nullptr; ++at) ++count;
  std::free(text);
  return count;
}

// In processes of their own: the limit holds for all threads, forever.
TEST(ShareMallocArenasDeathTest, ThreadsShareThem) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        ShareMallocArenas(2);
        std::exit(ArenasOfEightThreads());
      },
      testing::ExitedWithCode(2),
      "");
  EXPECT_EXIT(std::exit(ArenasOfEightThreads() > 2 ? 0 : 1), testing::ExitedWithCode(0), "");
}

// What a check says about a value; empty when it accepts it.
std::string RangeComplaint(double value, double low, double high) {
  try {
    RangeCheck("test option")("sigma", value, low, high);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(RangeCheckTest, NamesFieldValueAndRange) {
  EXPECT_EQ(RangeComplaint(0.25, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(0.0, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(1.0, 0.0, 1.0), "");
  EXPECT_EQ(RangeComplaint(1.00001, 0.0, 1.0), "test option sigma is 1.00001; it must be 0 to 1");
  EXPECT_EQ(RangeComplaint(0.0, 1e-6, 0.5), "test option sigma is 0; it must be 1e-06 to 0.5");
  EXPECT_EQ(RangeComplaint(100001, 0, 100000),
            "test option sigma is 100001; it must be 0 to 100000");
}

TEST(RangeCheckTest, NoNumberIsInNoRange) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_NE(RangeComplaint(std::nan(""), -infinity, infinity), "");
  EXPECT_NE(RangeComplaint(infinity, 0.0, 1.0), "");
}

}  // namespace
}  // namespace color3d
