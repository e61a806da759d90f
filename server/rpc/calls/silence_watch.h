// Ends streams whose client is inactive for too long: a silent upload, an unread download. Each
// holds a place that others need. Runs one thread. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <thread>

#include "core/base/mutex.h"

namespace color3d {

class SilenceWatch {
 public:
  // `limit`: maximum time to wait for the client of a stream.
  explicit SilenceWatch(std::chrono::milliseconds limit);
  // Requires: all streams are destroyed.
  ~SilenceWatch();
  SilenceWatch(const SilenceWatch&) = delete;
  SilenceWatch& operator=(const SilenceWatch&) = delete;

  std::chrono::milliseconds limit() const { return limit_; }

  // One stream. It waits for the client between Wait and Resume.
  class Stream {
   public:
    // `on_silence` is called at most once, without a lock, on the thread of the watch. After that
    // only `on_silence` may destroy what the stream uses. `limit` 0: the limit of the watch.
    Stream(SilenceWatch& watch,
           std::function<void()> on_silence,
           std::chrono::milliseconds limit = std::chrono::milliseconds(0));
    ~Stream();
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    // Starts to wait for the client.
    void Wait();
    // The client was active. Returns false if it was too late: `on_silence` was or will be called.
    bool Resume();

   private:
    friend class SilenceWatch;
    SilenceWatch& watch_;
    const std::function<void()> on_silence_;
    const std::chrono::milliseconds limit_;
  };

 private:
  struct State {
    bool waiting = false, silent = false;
    std::chrono::steady_clock::time_point since;
  };
  void Loop();

  const std::chrono::milliseconds limit_;
  Mutex mutex_;
  CondVar wake_;
  std::map<Stream*, State> streams_ COLOR3D_GUARDED_BY(mutex_);
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace color3d
