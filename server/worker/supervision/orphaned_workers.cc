#include "server/worker/supervision/orphaned_workers.h"

#include <poll.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

#include "server/ops/process_state.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> CommandLineOf(pid_t pid) {
  std::ifstream stream("/proc/" + std::to_string(pid) + "/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(stream, word, '\0');) words.push_back(word);
  return words;
}

std::string ValueAfter(const std::vector<std::string>& words, const char* flag) {
  const auto found = std::ranges::find(words, flag);
  return found == words.end() || std::next(found) == words.end() ? "" : *std::next(found);
}

// Id of a worker that another server started for this folder.
std::optional<std::string> OrphanId(pid_t pid, const fs::path& data_folder) {
  const fs::path process = "/proc/" + std::to_string(pid);
  struct stat status {};
  if (::stat(process.c_str(), &status) != 0 || status.st_uid != ::geteuid()) return std::nullopt;
  const std::vector<std::string> words = CommandLineOf(pid);
  const std::string parent = ValueAfter(words, "--parent-pid"),
                    folder = ValueAfter(words, "--data-dir"), name = ValueAfter(words, "--name");
  if (parent.empty() || folder.empty() || name.empty()) return std::nullopt;
  if (parent == std::to_string(::getpid())) return std::nullopt;
  std::error_code error;
  const fs::path there =
      fs::path(folder).is_absolute() ? fs::path(folder) : process / "cwd" / folder;
  if (!fs::equivalent(there, data_folder, error) || error) return std::nullopt;
  return name + "-" + std::to_string(pid);
}

bool HasExited(int handle) {
  pollfd look{handle, POLLIN, 0};
  return ::poll(&look, 1, 0) == 1;
}

}  // namespace

OrphanedWorkers::OrphanedWorkers(const fs::path& data_folder, std::chrono::milliseconds grace)
    : end_at_(std::chrono::steady_clock::now() + grace) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    pid_t pid = 0;
    const auto parsed = std::from_chars(name.data(), name.data() + name.size(), pid);
    if (parsed.ec != std::errc() || parsed.ptr != name.data() + name.size()) continue;
    if (!OrphanId(pid, data_folder) || !IsRunning(pid)) continue;
    const int handle = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
    if (handle < 0) continue;
    // Checked again, because the pid may have been reused before the handle was opened.
    const std::optional<std::string> id = OrphanId(pid, data_folder);
    if (!id) {
      ::close(handle);
      continue;
    }
    spdlog::info("{} has outlived its server", *id);
    orphans_.push_back({*id, pid, handle, false});
  }
}

OrphanedWorkers::~OrphanedWorkers() {
  for (const Orphan& orphan : orphans_) ::close(orphan.handle);
}

std::vector<std::string> OrphanedWorkers::Look() {
  std::vector<std::string> gone;
  const bool late = std::chrono::steady_clock::now() >= end_at_;
  for (Orphan& orphan : orphans_) {
    if (HasExited(orphan.handle)) {
      gone.push_back(orphan.id);
      ::close(orphan.handle);
      orphan.handle = -1;
      continue;
    }
    const bool stopped = IsStopped(orphan.pid);
    if (orphan.killed || (!stopped && !late)) continue;
    spdlog::warn("{} {}; killing it", orphan.id, stopped ? "is frozen" : "does not end");
    ::syscall(SYS_pidfd_send_signal, orphan.handle, SIGKILL, nullptr, 0);
    orphan.killed = true;
  }
  std::erase_if(orphans_, [](const Orphan& orphan) { return orphan.handle < 0; });
  return gone;
}

}  // namespace color3d
