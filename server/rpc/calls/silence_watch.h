// Streams whose other side does nothing for too long: an upload that sends nothing, a download that
// nobody reads. Each holds a place that others could have. One thread of its own. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <set>
#include <thread>

namespace color3d {

class SilenceWatch {
 public:
  // Stops to wait for a stream after `limit`.
  explicit SilenceWatch(std::chrono::milliseconds limit);
  // No stream may be left.
  ~SilenceWatch();
  SilenceWatch(const SilenceWatch&) = delete;
  SilenceWatch& operator=(const SilenceWatch&) = delete;

  std::chrono::milliseconds limit() const { return limit_; }

  // One stream. It is either the other side's turn (between Wait and Resume) or ours.
  class Stream {
   public:
    // `on_silence` is called at most once, without a lock, on the watch's thread; from then on the
    // stream is over, and only `on_silence` may let what it uses be destroyed.
    // `limit` 0: the watch's own.
    Stream(SilenceWatch& watch,
           std::function<void()> on_silence,
           std::chrono::milliseconds limit = std::chrono::milliseconds(0));
    ~Stream();
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    // From now on it is the other side's turn.
    void Wait();
    // The other side has done something. False: too late, `on_silence` was called or will be.
    bool Resume();

   private:
    friend class SilenceWatch;
    SilenceWatch& watch_;
    const std::function<void()> on_silence_;
    const std::chrono::milliseconds limit_;
    bool waiting_ = false, silent_ = false;
    std::chrono::steady_clock::time_point since_;
  };

 private:
  void Loop();

  const std::chrono::milliseconds limit_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::set<Stream*> streams_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace color3d
