// Which files have been left alone for long. The clock on the wall may have been set since, so that
// it is not believed alone: a file is stale when it was old at the last look already, and is
// unchanged. Not thread-safe.
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
  // Begins another look at all files.
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
