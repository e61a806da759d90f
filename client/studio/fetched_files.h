// Results of jobs as files of this machine: each is downloaded once, also when several requests
// want it at the same time. Thread-safe.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client/studio/studio_calls.h"
#include "core/base/files.h"
#include "core/base/mutex.h"

namespace color3d::client {

class FetchedFiles {
 public:
  // Requires: `calls` outlives this object.
  explicit FetchedFiles(const StudioCalls& calls) : calls_(calls) {}

  struct Result {
    std::filesystem::path file;  // stays while this object lives
    std::string media_type;
  };
  // Result `name` of a job. Throws Error{kInvalidArgument} if the name is none of a file, and what
  // StudioCalls::Fetch throws.
  Result Of(const std::string& job, const std::string& name);
  // For files that are made from them.
  const std::filesystem::path& folder() const { return scratch_.path(); }

 private:
  struct Entry {
    Mutex mutex;
    std::optional<std::string> media_type COLOR3D_GUARDED_BY(mutex);  // once it is there
  };

  const StudioCalls& calls_;
  const ScratchFolder scratch_;
  Mutex mutex_;
  std::map<std::pair<std::string, std::string>, std::shared_ptr<Entry>> entries_
      COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d::client
