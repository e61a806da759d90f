// Detects files that have not changed for long. Because the wall clock may jump, a file is stale
// only if it was already old at the last scan and is unchanged. Not thread-safe.
#pragma once

#include <sys/stat.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

namespace color3d {

class StaleFiles {
 public:
  // Begins another scan of all files.
  void Look(std::chrono::seconds age) {
    oldest_ = std::time(nullptr) - age.count();
    before_ = std::exchange(old_, {});
  }
  bool IsStale(const std::filesystem::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0 || status.st_mtime > oldest_) return false;
    const State state{status.st_mtime, status.st_size};
    old_[file.string()] = state;
    const auto known = before_.find(file.string());
    return known != before_.end() && known->second == state;
  }

 private:
  using State = std::pair<std::time_t, off_t>;
  std::time_t oldest_ = 0;
  std::map<std::string, State> before_, old_;
};

}  // namespace color3d
