#include "core/scene/sfm/colmap_process.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <future>
#include <thread>
#include <utility>

#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/process/subprocess.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;

// Limits for the database of thousands of photos; never reached in practice.
constexpr int64_t kMaxFileBytes = int64_t{16} << 30;
// Minimum memory that is worth an attempt, even if less is free at present.
constexpr int64_t kLeastMemoryBytes = int64_t{1} << 30;

ProcessLimits MakeLimits(std::chrono::seconds timeout) {
  ProcessLimits limits;
  limits.memory_bytes = std::max(AvailableMemoryBytes(), kLeastMemoryBytes);
  limits.file_bytes = kMaxFileBytes;
  // Every thread may use the CPU all the time; the overall time limit applies first.
  limits.cpu_seconds = (timeout.count() + 60) * std::max(1u, std::thread::hardware_concurrency());
  limits.descriptors = 1024;
  limits.processes = 8192;
  return limits;
}

// Counts new lines that contain `mark` in a growing log.
class LogCounter {
 public:
  LogCounter(const fs::path& log, std::string mark) : log_(log), mark_(std::move(mark)) {
    std::error_code error;
    const auto size = fs::file_size(log, error);
    at_ = error ? 0 : static_cast<std::streamoff>(size);
  }
  int64_t Count() {
    std::ifstream in(log_, std::ios::binary);
    in.seekg(at_);
    std::string line;
    // An incomplete line is read again next time.
    while (std::getline(in, line) && !in.eof()) {
      if (line.find(mark_) != std::string::npos) ++count_;
      at_ = in.tellg();
    }
    return count_;
  }

 private:
  fs::path log_;
  std::string mark_;
  std::streamoff at_ = 0;
  int64_t count_ = 0;
};

}  // namespace

ColmapProcess::ColmapProcess(fs::path log, std::chrono::seconds timeout, const RunControl& run)
    : log_(std::move(log)), timeout_(timeout), run_(run), deadline_(Clock::now() + timeout) {}

void ColmapProcess::Note(const std::string& line) const {
  std::ofstream(log_, std::ios::app) << "color3d: " << line << "\n";
}

void ColmapProcess::Warn(const std::string& line) const {
  Note(line);
  run_.progress.OnWarning(line);
}

std::string ColmapProcess::Threads() const { return std::to_string(run_.pool.thread_count()); }

int ColmapProcess::Run(const std::vector<std::string>& arguments, const ColmapPhase& phase) {
  SubprocessOptions child;
  child.arguments = {"colmap"};
  child.arguments.insert(child.arguments.end(), arguments.begin(), arguments.end());
  // The process may write beside its log only.
  const fs::path folder = fs::absolute(log_).parent_path();
  child.environment = {"QT_QPA_PLATFORM=offscreen", "TMPDIR=" + folder.string()};
  if (IsSandboxing()) {
    child.sandbox = SandboxRules();
    child.sandbox->writable = {folder};
  }
  child.log_path = log_;
  child.timeout = std::chrono::duration_cast<std::chrono::seconds>(deadline_ - Clock::now());
  if (child.timeout.count() <= 0) ThrowTooSlow();
  child.limits = MakeLimits(child.timeout);
  LogCounter counter(log_, phase.mark);
  run_.progress.OnProgress(0, phase.total, phase.message);
  // The child runs on a thread of its own, so that progress is reported from the calling thread,
  // and with a token of its own, so that it also stops if an observer throws.
  CancellationToken stop;
  auto running =
      std::async(std::launch::async, [&child, &stop] { return RunSubprocess(child, stop); });
  int64_t reported = 0;
  try {
    while (running.wait_for(std::chrono::milliseconds(200)) != std::future_status::ready) {
      run_.cancel.ThrowIfCancelled();
      const int64_t done = std::min(counter.Count(), phase.total);
      if (done == reported) continue;
      reported = done;
      run_.progress.OnProgress(
          done, phase.total, fmt::format("{} {}/{}", phase.message, done, phase.total));
    }
  } catch (...) {
    stop.Cancel();  // the future's destructor waits for the child to exit
    throw;
  }
  const SubprocessResult result = running.get();
  if (result.timed_out) ThrowTooSlow();
  if (result.signal != 0 && LogContains("std::bad_alloc")) {
    throw Error(ErrorCode::kResourceExhausted,
                "colmap {} ran out of memory at the {} MiB that it may take; use fewer photos or "
                "fewer features, or {}; log: {}",
                arguments.at(0),
                child.limits.memory_bytes >> 20,
                MemoryRemedy(),
                log_.filename().string());
  }
  if (result.signal != 0) {
    throw Error(
        ErrorCode::kUnavailable,
        "colmap {} was ended by signal {} ({}), which says nothing of the photos; {}: use fewer "
        "photos or fewer features, or a machine with more; log: {}",
        arguments.at(0),
        result.signal,
        ::strsignal(result.signal),
        LikelyCause(result.signal, child.limits),
        log_.filename().string());
  }
  return result.exit_code;
}

void ColmapProcess::RunOrThrow(const std::vector<std::string>& arguments,
                               const ColmapPhase& phase) {
  const int code = Run(arguments, phase);
  if (code == 0) return;
  throw Error(ErrorCode::kInternal,
              "colmap {} failed with exit code {}: {}; log: {}",
              arguments.at(0),
              code,
              LastLogLine(),
              log_.filename().string());
}

void ColmapProcess::ThrowTooSlow() const {
  throw Error(ErrorCode::kDeadlineExceeded,
              "finding camera positions took longer than {} s; use fewer photos, fewer features or "
              "a longer time limit",
              timeout_.count());
}

bool ColmapProcess::LogContains(const std::string& text) const {
  std::ifstream in(log_);
  std::string line;
  while (std::getline(in, line)) {
    if (line.find(text) != std::string::npos) return true;
  }
  return false;
}

std::string ColmapProcess::LastLogLine() const {
  std::ifstream in(log_);
  std::string line, last;
  while (std::getline(in, line)) {
    if (!line.empty()) last = line;
  }
  // Messages do not disclose server paths.
  const std::string folder = fs::absolute(log_).parent_path().string() + "/";
  for (size_t at = last.find(folder); at != last.npos; at = last.find(folder, at)) {
    last.erase(at, folder.size());
  }
  return last.substr(0, 200);
}

}  // namespace color3d
