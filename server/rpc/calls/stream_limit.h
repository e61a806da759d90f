// How many streams of a kind may be open at once, in all and of one project. Thread-safe.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "server/base/service_error.h"

namespace color3d {

class StreamLimit {
 public:
  // `what`, in the plural, is for the message. `max_of_project` 0: no limit of its own. `shared`: a
  // project may have no more than would stay free, so that one has half of all, two a third each,
  // and so on, and there is always a place for the next one.
  StreamLimit(const char* what, int max, int max_of_project, bool shared = false)
      : what_(what), max_(max), max_of_project_(max_of_project), shared_(shared) {}

  // One open stream; its place is free again when this is destroyed.
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
    std::lock_guard lock(mutex_);
    return all_;
  }

  // Throws Error{kResourceExhausted}: TOO_MANY_STREAMS, or QUOTA_EXCEEDED of the project's share.
  Place Take(const std::string& project) {
    std::lock_guard lock(mutex_);
    const auto of_project = open_.find(project);
    const int own = of_project == open_.end() ? 0 : of_project->second;
    if (max_of_project_ > 0 && own >= max_of_project_) {
      throw ServiceError(
          ErrorReason::kQuotaExceeded,
          fmt::format("{} {} of your project are open, which is as many as it may have; close some",
                      own,
                      what_),
          {{"project:" + project + " " + what_, fmt::format("{} of {}", own, max_of_project_)}});
    }
    if (all_ >= max_) {
      throw ServiceError(ErrorReason::kTooManyStreams,
                         "{} {} are open, which is as many as this server allows; close some, or "
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
    std::lock_guard lock(mutex_);
    --all_;
    if (--open_[project] == 0) open_.erase(project);
  }

  const char* what_;
  const int max_, max_of_project_;
  const bool shared_;
  std::mutex mutex_;
  int all_ = 0;
  std::map<std::string, int> open_;  // by project
};

}  // namespace color3d
