// Workers that have outlived their server. Normally they save and end when it dies; the next server
// on the data folder, to which they release their jobs, ends the remaining ones. Not thread-safe.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

class OrphanedWorkers {
 public:
  // Finds processes of this user that another server started for this data folder.
  OrphanedWorkers(const std::filesystem::path& data_folder, std::chrono::milliseconds grace);
  ~OrphanedWorkers();
  OrphanedWorkers(const OrphanedWorkers&) = delete;
  OrphanedWorkers& operator=(const OrphanedWorkers&) = delete;

  // Ends all after the grace period, and frozen ones at once, because they release nothing. Returns
  // the ids ("worker-1-4711") of those that have ended since the last call.
  std::vector<std::string> Look();

 private:
  struct Orphan {
    std::string id;
    pid_t pid = 0;
    int handle = -1;  // pidfd, which is immune to reuse of the pid
    bool killed = false;
  };
  std::vector<Orphan> orphans_;
  const std::chrono::steady_clock::time_point end_at_;
};

}  // namespace color3d
