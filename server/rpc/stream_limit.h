// How many streams of a kind may be open at once. Thread-safe.
#pragma once

#include <atomic>
#include <utility>

#include "server/service_error.h"

namespace color3d {

class StreamLimit {
 public:
  // `what`, in the plural, is for the message.
  StreamLimit(const char* what, int max) : what_(what), max_(max) {}

  // One open stream; its place is free again when this is destroyed.
  class Place {
   public:
    Place() = default;
    explicit Place(std::atomic<int>* open) : open_(open) {}
    ~Place() {
      if (open_ != nullptr) --*open_;
    }
    Place(Place&& other) noexcept : open_(std::exchange(other.open_, nullptr)) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(open_, other.open_);
      return *this;
    }

   private:
    std::atomic<int>* open_ = nullptr;
  };

  // Throws Error{kResourceExhausted, TOO_MANY_STREAMS}.
  Place Take() {
    Place place(&open_);
    if (++open_ <= max_) return place;
    throw ServiceError(ErrorCode::kResourceExhausted,
                       "TOO_MANY_STREAMS",
                       "{} {} are open, which is as many as this server allows; close some, or try "
                       "again later",
                       max_,
                       what_);
  }

 private:
  const char* what_;
  const int max_;
  std::atomic<int> open_{0};
};

}  // namespace color3d
