#include "core/base/memory.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <string>

#ifdef __GLIBC__  // known only after a standard header
#include <malloc.h>
#endif

namespace color3d {
namespace fs = std::filesystem;
namespace {

// The first number of a file; nullopt for "max" and for files that are not there.
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

// What a control group leaves, or INT64_MAX when it has no limit.
int64_t LeftInGroup(const fs::path& folder, const char* limit_file, const char* usage_file) {
  const std::optional<int64_t> limit = NumberIn(folder / limit_file);
  if (!limit) return INT64_MAX;
  return std::max<int64_t>(0, *limit - NumberIn(folder / usage_file).value_or(0));
}

int64_t MemAvailable(const fs::path& root) {
  std::ifstream in(root / "proc/meminfo");
  std::string key;
  int64_t kib = 0;
  while (in >> key >> kib) {
    if (key == "MemAvailable:") return kib * 1024;
    std::getline(in, key);
  }
  return INT64_MAX;
}

}  // namespace

int64_t AvailableMemoryBytes(const fs::path& root) {
  int64_t available = MemAvailable(root);
  const fs::path v2 = root / "sys/fs/cgroup", v1 = v2 / "memory";
  const auto consider_v2 = [&](const fs::path& group) {
    available = std::min(available, LeftInGroup(v2 / group, "memory.max", "memory.current"));
  };
  const auto consider_v1 = [&](const fs::path& group) {
    available = std::min(available,
                         LeftInGroup(v1 / group, "memory.limit_in_bytes", "memory.usage_in_bytes"));
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
  return available;
}

int64_t ResidentMemoryBytes() { return StatusBytes("VmRSS:"); }
int64_t PeakMemoryBytes() { return StatusBytes("VmHWM:"); }

void ResetPeakMemory() {
  std::ofstream clear("/proc/self/clear_refs");
  clear << "5";
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

}  // namespace color3d
