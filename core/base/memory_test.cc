#include "core/base/memory.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <barrier>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "core/base/files.h"
#include "core/base/process/process_limits.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

TEST(AvailableMemory, IsMinimumOfSystemAndGroups) {
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

TEST(MachineMemory, IsMinimumOfMachineAndGroupLimits) {
  const ScratchFolder root;
  const auto put = [&](const std::string& file, const std::string& text) {
    fs::create_directories((root.path() / file).parent_path());
    WriteFileAtomic(root.path() / file, text);
  };
  EXPECT_EQ(MachineMemoryBytes(root.path()), INT64_MAX);
  put("proc/meminfo", "MemTotal:  9000 kB\nMemAvailable:   5000 kB\n");
  EXPECT_EQ(MachineMemoryBytes(root.path()), 9000 * 1024);
  put("proc/self/cgroup", "0::/c/d\n");
  put("sys/fs/cgroup/c/memory.max", "4000000\n");
  put("sys/fs/cgroup/c/memory.current", "3999999\n");  // includes the used memory
  EXPECT_EQ(MachineMemoryBytes(root.path()), 4000000);
}

TEST(IsOutOfMemory, KnowsMessagesOfLibraries) {
  EXPECT_TRUE(IsOutOfMemory(std::bad_alloc()));
  EXPECT_TRUE(IsOutOfMemory(std::system_error(EAGAIN, std::generic_category())));
  EXPECT_TRUE(IsOutOfMemory(std::runtime_error(
      "[enforce fail at alloc_cpu.cpp:66] . DefaultCPUAllocator: can't allocate memory: you tried "
      "to allocate 4000000000 bytes.")));
  EXPECT_TRUE(IsOutOfMemory(std::runtime_error("resizing failed: Failed to allocate 9 bytes")));
  EXPECT_FALSE(IsOutOfMemory(std::runtime_error("a.png is damaged")));
  EXPECT_FALSE(IsOutOfMemory(std::system_error(ENOENT, std::generic_category())));
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// Runs `check` in a child process, because a limit cannot be raised again.
int InLimitedProcess(int64_t memory_bytes, const std::function<bool()>& check) {
  const pid_t child = ::fork();
  if (child == 0) {
    ProcessLimits limits;
    limits.memory_bytes = memory_bytes;
    const bool limited = LimitProcess(limits) && PreferAsOomVictim();
    ::_exit(limited && check() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

TEST(OwnMemory, ReportsRemainderOfLimit) {
  EXPECT_EQ(OwnMemoryLimitBytes(), INT64_MAX);
  EXPECT_EQ(OwnMemoryLeftBytes(), INT64_MAX);
  constexpr int64_t kLimit = int64_t{256} << 20, kBlock = int64_t{64} << 20;
  EXPECT_EQ(InLimitedProcess(kLimit,
                             [&] {
                               const int64_t left = OwnMemoryLeftBytes();
                               const auto block = std::make_unique<char[]>(kBlock);
                               return OwnMemoryLimitBytes() == kLimit && left < kLimit &&
                                      OwnMemoryLeftBytes() <= left - kBlock &&
                                      AvailableMemoryBytes() <= left - kBlock &&
                                      MemoryRemedy().find("256 MiB") != std::string::npos;
                             }),
            0);
  EXPECT_EQ(InLimitedProcess(kLimit,
                             [] {
                               std::ifstream score("/proc/self/oom_score_adj");
                               int value = 0;
                               return score >> value && value == 500;
                             }),
            0);
}
#endif

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(ReleaseFreedMemory, ReturnsFreedMemoryToSystem) {
  constexpr size_t kBlock = 16 << 10, kBlocks = 8192;  // too small for a mapping each
  std::vector<std::unique_ptr<char[]>> blocks(kBlocks);
  for (auto& block : blocks) {
    block.reset(new char[kBlock]);
    std::memset(block.get(), 1, kBlock);
  }
  const int64_t full = ResidentMemoryBytes();
  // The last block prevents the heap from shrinking by itself.
  for (size_t i = 0; i + 1 < kBlocks; ++i) blocks[i].reset();
  ReleaseFreedMemory();
  EXPECT_LT(ResidentMemoryBytes(), full - int64_t{kBlock * kBlocks / 2});
}
#endif

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(KeepFreedMemoryDeathTest, KeepsUntilReleased) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  constexpr size_t kBlock = 24 << 20;
  const auto resident_after_use = [] {
    for (int i = 0; i < 4; ++i) {
      const std::unique_ptr<char[]> block(new char[kBlock]);
      std::memset(block.get(), 1, kBlock);
    }
    return ResidentMemoryBytes();
  };
  EXPECT_EXIT(
      {
        const int64_t before = ResidentMemoryBytes();
        KeepFreedMemory();
        const bool kept = resident_after_use() - before > int64_t{kBlock / 2};
        ReleaseFreedMemory();
        const bool released = ResidentMemoryBytes() - before < int64_t{kBlock / 2};
        std::exit(kept && released ? 0 : 1);
      },
      testing::ExitedWithCode(0),
      "");
}
#endif

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

// In child processes, because the limit holds for all threads and cannot be undone.
TEST(ShareMallocArenasDeathTest, ThreadsShareArenas) {
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

}  // namespace
}  // namespace color3d
