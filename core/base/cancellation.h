// Cooperative cancellation. The owner calls Cancel() from any thread; every loop longer than 100 ms
// calls ThrowIfCancelled() once an iteration. Thread-safe.
#pragma once

#include <atomic>

#include "core/base/error.h"

namespace color3d {

class CancellationToken {
 public:
  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool IsCancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  // Throws Error{kCancelled}.
  void ThrowIfCancelled() const {
    if (IsCancelled()) throw Error(ErrorCode::kCancelled, "the work was cancelled");
  }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace color3d
