#include "core/base/process/process_limits.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>

namespace color3d {
namespace {

// Sets the soft and the hard limit; the latter cannot be raised again.
bool Lower(int resource, rlim_t value) noexcept {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return false;
  limit.rlim_max = std::min(limit.rlim_max, value);
  limit.rlim_cur = std::min(limit.rlim_cur, limit.rlim_max);
  return ::setrlimit(resource, &limit) == 0;
}

bool LowerIfGiven(int resource, int64_t value) noexcept {
  return value <= 0 || Lower(resource, static_cast<rlim_t>(value));
}

}  // namespace

bool LimitProcess(const ProcessLimits& limits) noexcept {
  return Lower(RLIMIT_CORE, 0) && LowerIfGiven(RLIMIT_DATA, limits.memory_bytes) &&
         LowerIfGiven(RLIMIT_FSIZE, limits.file_bytes) &&
         LowerIfGiven(RLIMIT_CPU, limits.cpu_seconds) &&
         LowerIfGiven(RLIMIT_NOFILE, limits.descriptors) &&
         LowerIfGiven(RLIMIT_NPROC, limits.processes);
}

bool PreferAsOomVictim() noexcept {
  // Range -1000 to 1000; the kernel adds up to 1000 for the process's share of memory.
  constexpr std::string_view kScore = "500";
  const int fd = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool written = ::write(fd, kScore.data(), kScore.size()) == ssize_t(kScore.size());
  ::close(fd);
  return written;
}

std::string LikelyCause(int signal, const ProcessLimits& limits) {
  if (signal == SIGXFSZ) {
    return fmt::format("it wrote a file of more than {} MiB", limits.file_bytes >> 20);
  }
  if (signal == SIGXCPU) {
    return fmt::format("it took more than {} s of the processors", limits.cpu_seconds);
  }
  if (limits.memory_bytes > 0) {
    return fmt::format("most often memory has run out; it may take {} MiB",
                       limits.memory_bytes >> 20);
  }
  return "most often memory has run out";
}

}  // namespace color3d
