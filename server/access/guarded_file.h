// A file of access rules. Only its owner may write to it; it is reloaded after changes.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/mutex.h"

namespace color3d {

// Thread-safe.
class GuardedFile {
 public:
  // `take` gets the bytes of the file: in the constructor, and under the lock of WithLatest after a
  // change. The constructor throws what `take` throws; later its exceptions are logged and the
  // previous contents kept. `what`: name for messages, e.g. "token file". Throws Error if the file
  // cannot be read or is writable by others than its owner.
  GuardedFile(const std::filesystem::path& file,
              const char* what,
              std::function<void(const std::string& bytes)> take);

  // Reloads a changed file, at most once a second, and then runs `use` under the lock.
  void WithLatest(const std::function<void()>& use);

 private:
  std::string Read() const;
  void Reload() COLOR3D_REQUIRES(mutex_);

  const std::filesystem::path file_;
  const char* const what_;
  const std::function<void(const std::string&)> take_;
  Mutex mutex_;
  std::string identity_ COLOR3D_GUARDED_BY(mutex_);  // of the loaded file
  std::chrono::steady_clock::time_point next_look_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
