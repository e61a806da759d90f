// Limits the number of open streams of a kind, in all and of one project. Thread-safe.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "core/base/mutex.h"
#include "server/base/service_error.h"

namespace color3d {

class StreamLimit {
 public:
  // `what`: plural noun for messages. `max_of_project` 0: no limit. `shared`: a project may have at
  // most as many streams as stay free, so that one project gets half of all and two get a third
  // each, and there is always a place for another project.
  StreamLimit(const char* what, int max, int max_of_project, bool shared = false)
      : what_(what), max_(max), max_of_project_(max_of_project), shared_(shared) {}

  // Place of one open stream; released by its destructor.
  class Place {
   public:
    Place() = default;
    Place(StreamLimit* limit, std::string project) : limit_(limit), project_(std::move(project)) {}
    ~Place() {
      if (limit_ != nullptr) limit_->Free(project_);
    }
    Place(Place&& other) noexcept
        : limit_(std::exchange(other.limit_, nullptr)), project_(std::move(other.project_)) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(limit_, other.limit_);
      std::swap(project_, other.project_);
      return *this;
    }

   private:
    StreamLimit* limit_ = nullptr;
    std::string project_;
  };

  int open() {
    const MutexLock lock(mutex_);
    return all_;
  }

  // Throws Error{kResourceExhausted}: TOO_MANY_STREAMS, or QUOTA_EXCEEDED for the project's share.
  Place Take(const std::string& project) {
    const MutexLock lock(mutex_);
    const auto of_project = open_.find(project);
    const int own = of_project == open_.end() ? 0 : of_project->second;
    if (max_of_project_ > 0 && own >= max_of_project_) {
      throw ServiceError(
          ErrorReason::kQuotaExceeded,
          fmt::format(
              "{} {} of your project are open, which is its maximum; close some", own, what_),
          {{"project:" + project + " " + what_, fmt::format("{} of {}", own, max_of_project_)}});
    }
    if (all_ >= max_) {
      throw ServiceError(ErrorReason::kTooManyStreams,
                         "{} {} are open, which is the maximum of this server; close some, or "
                         "try again later",
                         max_,
                         what_);
    }
    if (shared_ && own > 0 && own >= max_ - all_) {
      throw ServiceError(
          ErrorReason::kQuotaExceeded,
          fmt::format(
              "{} {} of your project are open, which is its share of the {} that this server "
              "allows; close some, or try again later",
              own,
              what_,
              max_),
          {{"project:" + project + " " + what_, fmt::format("{} of {} in all", own, max_)}});
    }
    ++all_;
    ++open_[project];
    return Place(this, project);
  }

 private:
  void Free(const std::string& project) {
    const MutexLock lock(mutex_);
    --all_;
    if (--open_[project] == 0) open_.erase(project);
  }

  const char* what_;
  const int max_, max_of_project_;
  const bool shared_;
  Mutex mutex_;
  int all_ COLOR3D_GUARDED_BY(mutex_) = 0;
  std::map<std::string, int> open_ COLOR3D_GUARDED_BY(mutex_);  // by project
};

}  // namespace color3d
