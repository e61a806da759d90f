#include "server/worker/remote/worker_place.h"

#include <fcntl.h>
#include <google/protobuf/util/time_util.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;

WorkerFolder::WorkerFolder(const DataPaths& paths) {
  std::error_code error;
  const auto fail = [&](const std::string& why) {
    return Error(ErrorCode::kFailedPrecondition,
                 "cannot use the folder {}: {}; choose another --cache-dir",
                 paths.root.string(),
                 why);
  };
  const bool is_fresh = fs::create_directories(paths.root, error);
  if (is_fresh) ::chmod(paths.root.c_str(), 0700);
  for (const fs::path& folder : {paths.Blobs(), paths.Scratch(), paths.Cache(), paths.JobLogs()}) {
    fs::create_directories(folder, error);
    if (error) throw fail(error.message());
  }
  lock_ = ::open(paths.Lock().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock_ < 0) throw fail(std::strerror(errno));
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock_);
    throw fail("another worker uses it");
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(paths.Scratch(), error)) {
    std::error_code ignored;
    fs::remove_all(entry.path(), ignored);
  }
}

WorkerFolder::~WorkerFolder() { ::close(lock_); }

fs::path DefaultWorkerFolder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache != nullptr && *cache != '\0') return fs::path(cache) / "color3d-worker";
  if (home != nullptr && *home != '\0') return fs::path(home) / ".cache" / "color3d-worker";
  throw InvalidArgument("there is no home folder for the cache; give --cache-dir");
}

std::string ReadToken(const fs::path& file) {
  constexpr int64_t kMaxBytes = 64 << 10;
  std::istringstream words(ReadFile(file, kMaxBytes));
  std::string token, rest;
  if (!(words >> token) || words >> rest) {
    throw InvalidArgument(
        "{} must contain one token and nothing else, as `color3d-server token --role worker` "
        "prints it",
        file.string());
  }
  return token;
}

std::chrono::steady_clock::time_point ParseUntil(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  int64_t seconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  constexpr int64_t kYears = int64_t{100} * 365 * 86'400;
  if (error == std::errc() && end == text.data() + text.size() && seconds >= 0 &&
      seconds < kYears) {
    return now + std::chrono::seconds(seconds);
  }
  google::protobuf::Timestamp time;
  if (!google::protobuf::util::TimeUtil::FromString(text, &time)) {
    throw InvalidArgument(
        "--until {}: give a time as 2026-01-31T18:00:00Z (RFC 3339), or seconds from now", text);
  }
  const auto wall = std::chrono::system_clock::from_time_t(time.seconds());
  const auto left = wall - std::chrono::system_clock::now();
  return now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(left);
}

}  // namespace color3d
