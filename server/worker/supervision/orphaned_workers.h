// Workers that have outlived their server. They save and end by themselves when it dies; those that
// do not, frozen ones among them, are ended by the next server on the same data folder. Not
// thread-safe.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

class OrphanedWorkers {
 public:
  // Finds them: processes of this user that were started for this data folder by another server.
  // Frozen ones are ended at once: one may hold the store's write lock.
  OrphanedWorkers(const std::filesystem::path& data_folder, std::chrono::milliseconds grace);
  ~OrphanedWorkers();
  OrphanedWorkers(const OrphanedWorkers&) = delete;
  OrphanedWorkers& operator=(const OrphanedWorkers&) = delete;

  // Ends those that are frozen, and all after the time of grace. Returns the ids, "worker-1-4711",
  // of those that are gone since the last call.
  std::vector<std::string> Look();

 private:
  struct Orphan {
    std::string id;
    pid_t pid = 0;
    int handle = -1;  // pidfd: of this process and no other that may get its number
    bool killed = false;
  };
  std::vector<Orphan> orphans_;
  const std::chrono::steady_clock::time_point end_at_;
};

}  // namespace color3d
