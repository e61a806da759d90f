// Where and how long a worker of another machine runs: its folder, its token, its time.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "server/storage/data_folder.h"

namespace color3d {

// The folder of a worker, whose layout is that of a data folder. Held by one process.
class WorkerFolder {
 public:
  // Creates the folder, accessible by its owner only, and removes what a killed worker left. Throws
  // Error{kFailedPrecondition} if that fails or another worker uses the folder.
  explicit WorkerFolder(const DataPaths& paths);
  ~WorkerFolder();
  WorkerFolder(const WorkerFolder&) = delete;
  WorkerFolder& operator=(const WorkerFolder&) = delete;

 private:
  int lock_ = -1;
};

// "color3d-worker" in $XDG_CACHE_HOME or ~/.cache. Throws Error{kInvalidArgument} without a home.
std::filesystem::path DefaultWorkerFolder();

// Returns the only word of the file. Throws Error.
std::string ReadToken(const std::filesystem::path& file);

// Parses an RFC 3339 time, e.g. "2026-01-31T18:00:00Z", or a number of seconds from now. Throws
// Error{kInvalidArgument}.
std::chrono::steady_clock::time_point ParseUntil(const std::string& text);

}  // namespace color3d
