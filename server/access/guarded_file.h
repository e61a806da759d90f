// A file that says who may do what. Only its owner may write to it; it is read again when it has
// changed.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>

namespace color3d {

// Thread-safe.
class GuardedFile {
 public:
  // `take` is given the file's bytes: here, and under the lock of WithLatest when they have
  // changed. What it throws at the first time is thrown on; afterwards it changes nothing and is
  // logged. `what` is for messages: "token file". Throws Error for a file that cannot be read or
  // that others than its owner may write to.
  GuardedFile(const std::filesystem::path& file,
              const char* what,
              std::function<void(const std::string& bytes)> take);

  // Looks for changes, at most once a second, and then runs `use`, alone.
  void WithLatest(const std::function<void()>& use);

 private:
  std::string Read() const;
  void ReadAgain();

  const std::filesystem::path file_;
  const char* const what_;
  const std::function<void(const std::string&)> take_;
  std::mutex mutex_;
  std::string identity_;  // of the file that was read
  std::chrono::steady_clock::time_point next_look_;
};

}  // namespace color3d
