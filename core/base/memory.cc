#include "core/base/memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#ifdef __GLIBC__  // known only after a standard header
#include <malloc.h>
#endif

namespace color3d {
namespace fs = std::filesystem;
namespace {

// The first number of a file; nullopt for "max" and for missing files.
std::optional<int64_t> NumberIn(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  if (!(in >> word)) return std::nullopt;
  int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc()) return std::nullopt;
  return value;
}

// A "Name:  123 kB" line of /proc/self/status, in bytes.
int64_t StatusBytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind(field, 0) == 0) return std::stoll(line.substr(field.size())) * 1024;
  }
  return 0;
}

// Memory left in a control group, or INT64_MAX without a limit.
int64_t LeftInGroup(const fs::path& folder, const char* limit_file, const char* usage_file) {
  const std::optional<int64_t> limit = NumberIn(folder / limit_file);
  if (!limit) return INT64_MAX;
  return std::max<int64_t>(0, *limit - NumberIn(folder / usage_file).value_or(0));
}

// A line of /proc/meminfo, in bytes.
int64_t MemInfo(const fs::path& root, std::string_view name) {
  std::ifstream in(root / "proc/meminfo");
  std::string key;
  int64_t kib = 0;
  while (in >> key >> kib) {
    if (key == name) return kib * 1024;
    std::getline(in, key);
  }
  return INT64_MAX;
}

// Calls `consider` with the folder of each control group of the process and with the names of the
// files that contain its limit and its use.
void ForEachGroup(
    const fs::path& root,
    const std::function<void(const fs::path&, const char* limit, const char* usage)>& consider) {
  const fs::path v2 = root / "sys/fs/cgroup", v1 = v2 / "memory";
  const auto consider_v2 = [&](const fs::path& group) {
    consider(v2 / group, "memory.max", "memory.current");
  };
  const auto consider_v1 = [&](const fs::path& group) {
    consider(v1 / group, "memory.limit_in_bytes", "memory.usage_in_bytes");
  };
  // A container sees its own group as the root; elsewhere every group on the way up may limit.
  consider_v2("");
  consider_v1("");
  std::ifstream groups(root / "proc/self/cgroup");  // "0::/path" or "4:memory:/path"
  for (std::string line; std::getline(groups, line);) {
    const size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    fs::path group = fs::path(line.substr(second + 1)).relative_path();
    for (; !group.empty(); group = group.parent_path()) {
      if (controllers.empty()) consider_v2(group);
      if (controllers == "memory") consider_v1(group);
    }
  }
}

}  // namespace

int64_t AvailableOnMachineBytes(const fs::path& root) {
  int64_t available = MemInfo(root, "MemAvailable:");
  ForEachGroup(root, [&](const fs::path& group, const char* limit, const char* usage) {
    available = std::min(available, LeftInGroup(group, limit, usage));
  });
  return available;
}

int64_t MachineMemoryBytes(const fs::path& root) {
  int64_t total = MemInfo(root, "MemTotal:");
  ForEachGroup(root, [&](const fs::path& group, const char* limit, const char*) {
    total = std::min(total, NumberIn(group / limit).value_or(INT64_MAX));
  });
  return total;
}

int64_t OwnMemoryLimitBytes() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return INT64_MAX;
  return static_cast<int64_t>(std::min<rlim_t>(limit.rlim_cur, INT64_MAX));
}

int64_t OwnMemoryBytes() { return StatusBytes("VmData:"); }

int64_t OwnMemoryLeftBytes() {
  const int64_t limit = OwnMemoryLimitBytes();
  return limit == INT64_MAX ? limit : std::max<int64_t>(0, limit - OwnMemoryBytes());
}

int64_t AvailableMemoryBytes(const fs::path& root) {
  return std::min(AvailableOnMachineBytes(root), OwnMemoryLeftBytes());
}

bool IsOutOfMemory(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return true;
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) {
    // EAGAIN: a thread's stack does not fit, either.
    const int code = system->code().value();
    return system->code().category() == std::generic_category() &&
           (code == ENOMEM || code == EAGAIN);
  }
  const std::string_view text = error.what();
  for (const std::string_view sign : {"allocate memory",       // torch, glibc
                                      "Insufficient memory",   // OpenCV
                                      "Failed to allocate",    // OpenCV
                                      "std::bad_alloc",        // wrapped by others
                                      "not enough memory"}) {  // torch
    if (text.find(sign) != std::string_view::npos) return true;
  }
  return false;
}

std::string MemoryRemedy() {
  const int64_t limit = OwnMemoryLimitBytes();
  if (limit == INT64_MAX) return "use a machine with more memory";
  return fmt::format(
      "give workers more than {} MiB each (color3d-server serve --worker-memory-mib)", limit >> 20);
}

int64_t ResidentMemoryBytes() { return StatusBytes("VmRSS:"); }
int64_t PeakMemoryBytes() { return StatusBytes("VmHWM:"); }

void ResetPeakMemory() {
  // Kept open, because a sandbox refuses to open it: call this once before entering one.
  static const int clear = ::open("/proc/self/clear_refs", O_WRONLY | O_CLOEXEC);
  // Where this fails, the peak stays that of all work before.
  [[maybe_unused]] const ssize_t written = ::write(clear, "5", 1);
}

void ReleaseFreedMemory() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

void ShareMallocArenas([[maybe_unused]] int arenas) {
#ifdef __GLIBC__
  ::mallopt(M_ARENA_MAX, std::max(1, arenas));
#endif
}

void KeepFreedMemory() {
#ifdef __GLIBC__
  constexpr int kLargestBlock = 32 << 20;  // glibc's limit
  constexpr int kKept = 256 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kLargestBlock);
  ::mallopt(M_TRIM_THRESHOLD, kKept);
#endif
}

}  // namespace color3d
